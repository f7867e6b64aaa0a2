//! Tables, and their Markdown: aligned columns, readable in a terminal as they are.

/// A table of text.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Table {
    /// Names of the columns.
    pub head: Vec<String>,
    /// Rows of as many cells.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    /// A table without rows.
    pub fn new<S: Into<String>>(head: impl IntoIterator<Item = S>) -> Self {
        Self {
            head: head.into_iter().map(Into::into).collect(),
            rows: Vec::new(),
        }
    }

    /// The columns of which every cell is empty or a dash go; the first one stays.
    pub fn without_empty_columns(mut self) -> Self {
        let filled = |column: usize| {
            let mut cells = self.rows.iter().filter_map(|row| row.get(column));
            column == 0 || cells.any(|cell| !matches!(cell.as_str(), "" | ABSENT))
        };
        let keep = (0..self.head.len()).map(filled).collect::<Vec<_>>();
        for row in self.rows.iter_mut().chain([&mut self.head]) {
            let mut columns = keep.iter();
            row.retain(|_| columns.next().is_some_and(|keep| *keep));
        }
        self
    }

    /// As Markdown.
    pub fn markdown(&self) -> String {
        let lines = || self.rows.iter().chain([&self.head]);
        let widths = (0..self.head.len())
            .map(|column| {
                let cells = lines().filter_map(|row| row.get(column));
                cells
                    .map(|cell| cell.chars().count())
                    .max()
                    .unwrap_or(0)
                    .max(3)
            })
            .collect::<Vec<_>>();
        let rule = widths.iter().map(|&width| "-".repeat(width)).collect();
        let mut text = String::new();
        for row in [&self.head, &rule].into_iter().chain(&self.rows) {
            for (cell, &width) in row.iter().zip(&widths) {
                text.push_str(&format!("| {cell:width$} "));
            }
            text.push_str("|\n");
        }
        text
    }
}

/// Stands where there is no value.
pub const ABSENT: &str = "-";

/// A table of `rows` under `head`.
pub fn markdown<const N: usize>(
    head: [&str; N],
    rows: impl IntoIterator<Item = [String; N]>,
) -> String {
    let mut table = Table::new(head);
    table.rows = rows.into_iter().map(Vec::from).collect();
    table.markdown()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_as_wide_as_their_widest_cell() {
        let table = markdown(
            ["a", "bb"],
            [["four".into(), "x".into()], ["1".into(), "é".into()]],
        );
        assert_eq!(
            table,
            "| a    | bb  |\n| ---- | --- |\n| four | x   |\n| 1    | é   |\n"
        );
    }

    #[test]
    fn columns_without_a_value_go() {
        let mut table = Table::new(["name", "a", "b"]);
        table.rows = vec![
            vec!["-".into(), "-".into(), "1".into()],
            vec!["x".into(), "".into(), "-".into()],
        ];
        let table = table.without_empty_columns();
        assert_eq!(table.head, ["name", "b"]);
        assert_eq!(table.rows, [["-", "1"], ["x", "-"]]);
    }
}
