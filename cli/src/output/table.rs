//! Pages for people: lines, aligned columns, and names with their values.

use comfy_table::{CellAlignment, presets};

use simd_client::{printable, printable_lines};

/// Output of a command, from top to bottom.
#[derive(Debug, Default)]
pub(crate) struct Page {
    blocks: Vec<Block>,
}

#[derive(Debug)]
enum Block {
    Line(String),
    Table(Table),
}

impl Page {
    pub(crate) fn new() -> Self {
        Self::default()
    }

    /// Makes a page of one line.
    pub(crate) fn of_line(text: impl Into<String>) -> Self {
        Self::new().line(text)
    }

    pub(crate) fn line(mut self, text: impl Into<String>) -> Self {
        self.blocks.push(Block::Line(text.into()));
        self
    }

    pub(crate) fn table(mut self, table: Table) -> Self {
        self.blocks.push(Block::Table(table));
        self
    }

    /// Adds names and values, one pair per line.
    pub(crate) fn pairs<N: Into<String>>(self, pairs: impl IntoIterator<Item = (N, String)>) -> Self {
        let rows = pairs.into_iter().map(|(name, value)| vec![name.into(), value]).collect();
        let columns = vec![Column::left(""), Column::left("")];
        self.table(Table { columns, rows, has_header: false })
    }

    pub(crate) fn render(&self, colour: bool) -> String {
        let mut text = String::new();
        for block in &self.blocks {
            match block {
                Block::Line(line) => text.push_str(&printable_lines(line)),
                Block::Table(table) => text.push_str(&table.render(colour)),
            }
            text.push('\n');
        }
        text
    }
}

/// Heading of a column, with its unit, and the alignment of its cells.
#[derive(Debug)]
pub(crate) struct Column {
    heading: String,
    is_right: bool,
}

impl Column {
    /// Makes a left-aligned column, for names.
    pub(crate) fn left(heading: impl Into<String>) -> Self {
        Self { heading: heading.into(), is_right: false }
    }

    /// Makes a right-aligned column, for numbers.
    pub(crate) fn right(heading: impl Into<String>) -> Self {
        Self { heading: heading.into(), is_right: true }
    }
}

/// Rows under headings.
#[derive(Debug)]
pub(crate) struct Table {
    columns: Vec<Column>,
    rows: Vec<Vec<String>>,
    has_header: bool,
}

impl Table {
    pub(crate) fn new(columns: Vec<Column>, rows: Vec<Vec<String>>) -> Self {
        Self { columns, rows, has_header: true }
    }

    fn render(&self, colour: bool) -> String {
        let mut table = comfy_table::Table::new();
        table.load_style(presets::NOTHING);
        if self.has_header {
            table.set_header(self.columns.iter().map(|column| column.heading.clone()).collect::<Vec<_>>());
        }
        for row in &self.rows {
            // A line break would disturb the alignment of the table.
            table.add_row(
                row.iter().map(|cell| printable(&cell.replace('\n', " ")).into_owned()).collect::<Vec<_>>(),
            );
        }
        for (index, column) in self.columns.iter().enumerate() {
            if let Some(inner) = table.column_mut(index) {
                inner.set_padding((0, 2));
                if column.is_right {
                    inner.set_cell_alignment(CellAlignment::Right);
                }
            }
        }
        let text = table.trim_fmt();
        match text.split_once('\n') {
            Some((header, rest)) if colour && self.has_header => format!("\x1b[1m{header}\x1b[0m\n{rest}"),
            _ => text,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Table {
        Table::new(
            vec![Column::left("JOINT"), Column::right("POSITION [rad]")],
            vec![vec!["shoulder".into(), "0.5000".into()], vec!["e\x1b[31m".into(), "-10.2500".into()]],
        )
    }

    #[test]
    fn names_line_up_on_the_left_and_numbers_on_the_right() {
        let text = Page::new().table(table()).render(false);
        let expected = "\
JOINT        POSITION [rad]
shoulder             0.5000
e\\u{1b}[31m        -10.2500
";
        assert_eq!(text, expected);
    }

    #[test]
    fn only_the_header_is_bold_and_only_where_colour_is_wanted() {
        let text = Page::new().table(table()).render(true);
        assert!(text.starts_with("\x1b[1mJOINT"), "{text:?}");
        assert_eq!(text.matches('\x1b').count(), 2);
    }

    #[test]
    fn pairs_have_no_header() {
        let text = Page::new().pairs([("state", "playing".into()), ("sim time", "1 s".into())]).render(true);
        assert_eq!(text, "state     playing\nsim time  1 s\n");
    }
}
