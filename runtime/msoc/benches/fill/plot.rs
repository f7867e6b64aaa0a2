//! Fig. 11 of the paper.

use std::path::Path;

use plotters::element::DashedPathElement;
use plotters::prelude::*;

use crate::{Fill, LEGS_PX, TRIANGLES};

/// Of the palette of Okabe and Ito, whose colours the colour-blind can tell apart.
fn colour(isa: &str) -> RGBColor {
    match isa {
        "avx512" => RGBColor(0, 114, 178),
        "avx2" => RGBColor(213, 94, 0),
        _ => RGBColor(0, 158, 115),
    }
}

/// Dash and gap of the line, radius of the dots, pixels, and whether they are filled.
fn style(what: &str) -> ([i32; 2], i32, bool) {
    match what {
        "paper" => ([12, 0], 4, true),
        "inner" => ([8, 5], 6, false),
        _ => ([2, 4], 0, true),
    }
}

/// Rate against triangle size, both logarithmic.
pub fn fill(path: &Path, rows: &[Fill]) -> Result<(), Box<dyn std::error::Error>> {
    let area = SVGBackend::new(path, (960, 600)).into_drawing_area();
    area.fill(&WHITE)?;
    // Ticks where something was measured: those of a logarithmic axis run into each other.
    let ticks = LEGS_PX.map(f64::from).to_vec();
    let sizes = (ticks[0]..ticks[ticks.len() - 1])
        .log_scale()
        .with_key_points(ticks);
    let mut chart = ChartBuilder::on(&area)
        .caption(
            "32,768 right triangles, back to front, one thread, 1920x1080",
            ("sans-serif", 20),
        )
        .margin(16)
        .x_label_area_size(44)
        .y_label_area_size(64)
        .build_cartesian_2d(sizes, (0.03..100.0).log_scale())?;
    chart
        .configure_mesh()
        .x_desc("legs, pixels")
        .x_label_formatter(&|legs| format!("{legs:.0}"))
        .y_desc("million triangles per second")
        .draw()?;
    let mut names = rows
        .iter()
        .map(|row| row.rasterizer.as_str())
        .collect::<Vec<_>>();
    names.sort_unstable();
    names.dedup();
    for name in &names {
        let (isa, what) = name.split_once(' ').unwrap_or((name, ""));
        let colour = colour(isa);
        let ([dash, gap], radius, filled) = style(what);
        let line = colour.stroke_width(2);
        let dot = ShapeStyle { filled, ..line };
        let points = rows.iter().filter(|row| row.rasterizer == *name);
        let points = points.map(|row| {
            let rate = TRIANGLES as f64 / row.seconds * 1e-6;
            (f64::from(row.legs_px), rate)
        });
        chart
            .draw_series(DashedLineSeries::new(points.clone(), dash, gap, line))?
            .label(*name)
            .legend(move |(x, y)| {
                let ends = [(x, y), (x + 36, y)];
                EmptyElement::at((0, 0))
                    + DashedPathElement::new(ends, dash, gap, line)
                    + Circle::new((x + 18, y), radius, dot)
            });
        chart.draw_series(points.map(|point| Circle::new(point, radius, dot)))?;
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::LowerLeft)
        .legend_area_size(44)
        .background_style(WHITE.mix(0.8))
        .border_style(BLACK)
        .draw()?;
    area.present()?;
    Ok(())
}
