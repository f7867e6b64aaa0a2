//! Fig. 11 of the paper.

use std::path::Path;

use plotters::prelude::*;

use crate::{Fill, LEGS_PX, TRIANGLES};

/// Rate against triangle size, both logarithmic.
pub fn fill(path: &Path, rows: &[Fill]) -> Result<(), Box<dyn std::error::Error>> {
    let area = SVGBackend::new(path, (960, 600)).into_drawing_area();
    area.fill(&WHITE)?;
    let sizes = f64::from(LEGS_PX[0])..f64::from(LEGS_PX[LEGS_PX.len() - 1]);
    let mut chart = ChartBuilder::on(&area)
        .caption(
            "32,768 right triangles, back to front, one thread, 1920x1080",
            ("sans-serif", 20),
        )
        .margin(16)
        .x_label_area_size(44)
        .y_label_area_size(64)
        .build_cartesian_2d(sizes.log_scale(), (0.03..100.0).log_scale())?;
    chart
        .configure_mesh()
        .x_desc("legs, pixels")
        .y_desc("million triangles per second")
        .draw()?;
    let mut names = rows
        .iter()
        .map(|row| row.rasterizer.as_str())
        .collect::<Vec<_>>();
    names.sort_unstable();
    names.dedup();
    for (index, name) in names.iter().enumerate() {
        let colour = Palette99::pick(index).to_rgba();
        let points = rows.iter().filter(|row| row.rasterizer == *name);
        let points = points.map(|row| {
            (
                f64::from(row.legs_px),
                TRIANGLES as f64 / row.seconds * 1e-6,
            )
        });
        chart
            .draw_series(LineSeries::new(points, colour.stroke_width(2)))?
            .label(*name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 20, y)], colour.stroke_width(2)));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::LowerLeft)
        .background_style(WHITE.mix(0.8))
        .border_style(BLACK)
        .draw()?;
    area.present()?;
    Ok(())
}
