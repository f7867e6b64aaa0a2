//! What is missed: false-occluded and leaked objects against the scalar full-resolution reference.

use std::fmt::Write;

use hroc_msoc::reference::Reference;
use hroc_msoc::{Isa, Mode, Msoc, Options, Visibility, generate};

use crate::scene::{camera, town};
use crate::{MODES, SIZE};

#[derive(Default)]
struct Tally {
    asked: usize,
    occluded: usize,
    false_occluded: usize,
    leaks: usize,
}

impl Tally {
    fn count(&mut self, ours: Visibility, truth: Visibility) {
        self.asked += 1;
        match (ours, truth) {
            (Visibility::Occluded, Visibility::Visible) => self.false_occluded += 1,
            (ours, Visibility::Occluded) => {
                self.occluded += 1;
                self.leaks += usize::from(ours == Visibility::Visible);
            }
            _ => {}
        }
    }

    fn row(&self, report: &mut String, what: &str, mode: &str) {
        let percent = |count: usize, of: usize| 100.0 * count as f64 / of.max(1) as f64;
        let _ = writeln!(
            report,
            "| {what} | {mode} | {} | {} | {} ({:.3} %) | {} ({:.2} %) |",
            self.asked,
            self.occluded,
            self.false_occluded,
            percent(self.false_occluded, self.asked),
            self.leaks,
            percent(self.leaks, self.occluded),
        );
    }
}

pub fn table(report: &mut String) -> Result<(), Box<dyn std::error::Error>> {
    let _ = writeln!(
        report,
        "\n## Accuracy\n\nAgainst a scalar reference of full resolution with the exact depth of every pixel centre (the \"2 %\" of the paper \
         is its leak against Hi-Z, which leaks itself).\n\n\
         | queries | mode | asked | reference hides | falsely occluded | leaked |\n|---|---|---|---|---|---|"
    );
    for (name, mode) in MODES {
        let options = Options {
            mode,
            near: 0.1,
            cull_back_faces: true,
            isa: Some(Isa::best()),
            ..Options::default()
        };
        let truth = Options {
            mode: Mode::Paper,
            ..options
        };
        let mut town_tally = Tally::default();
        for seed in 0..8 {
            let houses = town(seed);
            let view = camera(seed as f32 * 0.1 - 0.4, seed as f32 * 8.0 - 28.0);
            let (mut msoc, mut reference) =
                (Msoc::new(SIZE, options)?, Reference::new(SIZE, &truth)?);
            for house in &houses {
                msoc.rasterize(&view, &[house.occluder()])?;
                let clip = |index: u32| -> [f32; 4] {
                    let [x, y, z] = house.positions[index as usize];
                    std::array::from_fn(|row| {
                        view[0][row] * x + view[1][row] * y + (view[2][row] * z + view[3][row])
                    })
                };
                let triangles = house
                    .indices
                    .iter()
                    .map(|triangle| triangle.map(clip))
                    .collect::<Vec<_>>();
                reference.rasterize_clip(&triangles);
            }
            for house in &houses {
                let corners = std::array::from_fn(|corner| {
                    let at = |axis: usize| {
                        if corner >> axis & 1 == 0 {
                            house.bounds.min[axis]
                        } else {
                            house.bounds.max[axis]
                        }
                    };
                    let [x, y, z] = [at(0), at(1), at(2)];
                    std::array::from_fn(|row| {
                        view[0][row] * x + view[1][row] * y + (view[2][row] * z + view[3][row])
                    })
                });
                town_tally.count(
                    msoc.query_box_clip(&corners),
                    reference.query_box_clip(&corners),
                );
            }
        }
        town_tally.row(report, "houses of 8 towns, front to back", name);

        let size = [480, 270];
        let near = 0.5;
        let options = Options {
            near,
            cull_back_faces: false,
            ..options
        };
        let mut random = Tally::default();
        for seed in 0..400 {
            let (mut msoc, mut reference) = (
                Msoc::new(size, options)?,
                Reference::new(
                    size,
                    &Options {
                        near,
                        cull_back_faces: false,
                        ..truth
                    },
                )?,
            );
            let triangles = generate::triangles(seed, 300, size, near);
            msoc.rasterize_clip(&triangles);
            reference.rasterize_clip(&triangles);
            for rect in generate::rects(seed, 500, size, near) {
                random.count(msoc.query_rect(&rect), reference.query_rect(&rect));
            }
        }
        random.row(
            report,
            "random rectangles behind random triangles, no order",
            name,
        );
    }
    Ok(())
}
