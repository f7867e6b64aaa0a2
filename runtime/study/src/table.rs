//! Markdown tables with aligned columns, readable in a terminal as they are.

/// A table of `rows` under `head`.
pub fn markdown<const N: usize>(
    head: [&str; N],
    rows: impl IntoIterator<Item = [String; N]>,
) -> String {
    let rows = rows.into_iter().collect::<Vec<_>>();
    let head = head.map(str::to_owned);
    let widths: [usize; N] = std::array::from_fn(|column| {
        let cells = rows
            .iter()
            .chain([&head])
            .map(|row| row[column].chars().count());
        cells.max().unwrap_or(0).max(3)
    });
    let rule = widths.map(|width| "-".repeat(width));
    let mut table = String::new();
    for row in [&head, &rule].into_iter().chain(&rows) {
        for (cell, width) in row.iter().zip(widths) {
            table.push_str(&format!("| {cell:width$} "));
        }
        table.push_str("|\n");
    }
    table
}

#[cfg(test)]
mod tests {
    #[test]
    fn columns_are_as_wide_as_their_widest_cell() {
        let table = super::markdown(
            ["a", "bb"],
            [["four".into(), "x".into()], ["1".into(), "é".into()]],
        );
        assert_eq!(
            table,
            "| a    | bb  |\n| ---- | --- |\n| four | x   |\n| 1    | é   |\n"
        );
    }
}
