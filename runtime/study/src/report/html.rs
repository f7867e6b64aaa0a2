//! `report.html`: one page that needs nothing else.

use base64::Engine;
use base64::prelude::BASE64_STANDARD;

use super::markdown::title;
use super::plot::escape;
use super::{Block, Section};
use crate::compare::Comparison;
use crate::table::Table;

const STYLE: &str = "\
body { font: 15px/1.5 sans-serif; color: #222; background: #fff; max-width: 1120px; margin: 2em auto; padding: 0 1em; }
h1 { font-size: 1.7em; } h2 { font-size: 1.3em; margin-top: 2.2em; border-bottom: 1px solid #ccc; } h3 { font-size: 1em; margin: 1.6em 0 .4em; }
nav a { margin-right: 1.2em; white-space: nowrap; } a { color: #0072B2; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-size: 13px; font-variant-numeric: tabular-nums; }
th, td { padding: 3px 8px; text-align: right; border-bottom: 1px solid #e3e3e3; white-space: nowrap; }
th { border-bottom: 2px solid #999; vertical-align: bottom; } th:first-child, td:first-child { text-align: left; }
table.wide td, table.wide th { white-space: normal; text-align: left; overflow-wrap: anywhere; }
table.wide td:first-child, table.wide th:first-child { white-space: nowrap; }
svg { max-width: 100%; height: auto; }
.images { display: grid; grid-template-columns: repeat(auto-fill, minmax(320px, 1fr)); gap: 14px; }
figure { margin: 0; } figure img { width: 100%; image-rendering: pixelated; border: 1px solid #ccc; } figcaption { font-size: 13px; }
@media print { h2 { break-after: avoid; } svg, figure { break-inside: avoid; } }
";

/// The page.
pub(super) fn html(comparison: &Comparison, sections: &[Section]) -> String {
    let title = title(comparison);
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width\">\n<title>{title}</title>\n\
         <style>\n{STYLE}</style>\n</head>\n<body>\n<h1>{title}</h1>\n<nav>"
    );
    for (i, section) in sections.iter().enumerate() {
        page += &format!("<a href=\"#s{i}\">{}</a> ", escape(&section.title));
    }
    page += "</nav>\n";
    for (i, section) in sections.iter().enumerate() {
        page += &format!("<h2 id=\"s{i}\">{}</h2>\n", escape(&section.title));
        for block in &section.blocks {
            page += &self::block(block);
        }
    }
    page + "</body>\n</html>\n"
}

fn block(block: &Block) -> String {
    match block {
        Block::Text(text) => format!("<p>{}</p>\n", escape(text)),
        Block::Table { title, table } => heading(title) + &html_table(table),
        // In a page the namespace goes without saying.
        Block::Figure { title, svg, .. } => {
            heading(title) + &svg.replacen(" xmlns=\"http://www.w3.org/2000/svg\"", "", 1)
        }
        Block::Images(images) => {
            let figures = images.iter().map(|image| {
                let caption = escape(&image.caption);
                let data = BASE64_STANDARD.encode(&image.png);
                format!(
                    "<figure><img alt=\"{caption}\" src=\"data:image/png;base64,{data}\">\
                     <figcaption>{caption}</figcaption></figure>\n"
                )
            });
            format!(
                "<div class=\"images\">\n{}</div>\n",
                figures.collect::<String>()
            )
        }
    }
}

fn heading(title: &str) -> String {
    if title.is_empty() {
        String::new()
    } else {
        format!("<h3>{}</h3>\n", escape(title))
    }
}

fn html_table(table: &Table) -> String {
    let row = |cells: &[String], tag: &str| {
        let cells = cells
            .iter()
            .map(|cell| format!("<{tag}>{}</{tag}>", escape(cell)));
        format!("<tr>{}</tr>\n", cells.collect::<String>())
    };
    let rows = table
        .rows
        .iter()
        .map(|cells| row(cells, "td"))
        .collect::<String>();
    // Sentences rather than numbers.
    let long = table
        .rows
        .iter()
        .flatten()
        .any(|cell| cell.chars().count() > 60);
    let class = if long { " class=\"wide\"" } else { "" };
    format!(
        "<div class=\"scroll\"><table{class}>\n<thead>{}</thead>\n<tbody>\n{rows}</tbody>\n</table></div>\n",
        row(&table.head, "th")
    )
}

#[cfg(test)]
mod tests {
    use super::super::sections;
    use super::*;
    use crate::compare::Skipped;
    use crate::compare::tests::two_scenes;

    #[test]
    fn the_page_needs_nothing_else_and_has_every_contender() {
        let mut comparison = two_scenes();
        comparison.skipped.push(Skipped {
            scene: "town".into(),
            path: "orbit".into(),
            contender: "roc".into(),
            reason: "it needs <script src=\"http://x/y.js\">".into(),
        });
        let page = html(&comparison, &sections(&comparison));
        for foreign in [
            "http:", "https:", "<script", "<link", "@import", "url(", "<iframe",
        ] {
            let plain = page.replace("&lt;script src=&quot;http:", "");
            assert!(!plain.contains(foreign), "{foreign}");
        }
        let sources = page
            .match_indices("src=\"")
            .all(|(at, _)| page[at..].starts_with("src=\"data:"));
        assert!(sources && page.contains("&lt;script"));
        for label in comparison.labels() {
            assert!(page.contains(&label), "{label}");
        }
        assert!(page.contains("roc") && page.contains("hroc compare"));
    }
}
