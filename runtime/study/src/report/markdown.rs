//! `report.md`: the tables, with links to the plots.

use super::{Block, FIGURES, Section};
use crate::compare::{Comparison, Kind};

/// The heading of a report.
pub(super) const fn title(comparison: &Comparison) -> &'static str {
    match comparison.kind {
        Kind::Compare => "Culling methods compared",
        Kind::Study => "Split rules compared",
    }
}

/// The text.
pub(super) fn markdown(comparison: &Comparison, sections: &[Section]) -> String {
    let mut text = format!("# {}\n", title(comparison));
    for section in sections {
        text += &format!("\n## {}\n", section.title);
        for block in &section.blocks {
            match block {
                Block::Text(paragraph) => text += &format!("\n{paragraph}\n"),
                Block::Table { title, table } => {
                    if !title.is_empty() {
                        text += &format!("\n### {title}\n");
                    }
                    text += &format!("\n{}", table.markdown());
                }
                Block::Figure { name, title, .. } => {
                    text += &format!("\n![{title}]({FIGURES}/{name}.svg)\n");
                }
                Block::Images(images) => {
                    for image in images {
                        text += &format!("\n![{}]({FIGURES}/{}.png)\n", image.caption, image.name);
                    }
                }
            }
        }
    }
    text
}
