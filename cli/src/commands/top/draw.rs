//! The picture of `simctl top`. Names and errors are untrusted: characters that control a terminal are
//! escaped.

#[cfg(test)]
mod tests;

use ratatui::{
    Frame,
    layout::{Alignment, Constraint, Rect},
    style::{Color, Modifier, Style},
    text::{Line, Text},
    widgets::{Paragraph, Row, Table, TableState},
};
use simd_client::printable;

use super::{
    app::{App, Focus},
    world::{COLUMNS, ClientRow, Link, RobotRow, World, WorldColumn},
};

const KEYS: &str = "q end  up/down choose  tab robots  s sort  p pause/play";
/// Minimum height of a screen with details; below it, only worlds are shown.
const MIN_WITH_DETAILS: u16 = 9;
/// Minimum width of a screen with clients next to its robots.
const MIN_WITH_CLIENTS: u16 = 100;
const CLIENTS_WIDTH: u16 = 48;

/// Draws everything, on a screen of any size.
pub(super) fn draw(frame: &mut Frame<'_>, app: &App, worlds: &[World], colour: bool) {
    let paint = Paint { colour };
    let mut area = frame.area();
    if area.height >= 4 {
        title(frame, top_of(&mut area, 1), app, worlds, paint);
    }
    if area.height >= 2 {
        let last = Rect { y: area.y + area.height - 1, height: 1, ..area };
        area.height -= 1;
        status(frame, last, app, worlds, paint);
    }
    let Some(world) = app.world(worlds) else {
        frame.render_widget(Paragraph::new("looking for daemons"), area);
        return;
    };
    let rows = u16::try_from(worlds.len()).unwrap_or(u16::MAX).saturating_add(1);
    if area.height < MIN_WITH_DETAILS {
        self::worlds(frame, area, app, worlds, paint);
        return;
    }
    let half = area.height / 2;
    self::worlds(frame, top_of(&mut area, rows.min(half)), app, worlds, paint);
    top_of(&mut area, 1);
    let mut left = area;
    if area.width >= MIN_WITH_CLIENTS {
        left.width -= CLIENTS_WIDTH;
        let right = Rect { x: left.x + left.width, width: CLIENTS_WIDTH, ..area };
        clients(frame, right, world, paint);
        left.width -= 2;
    }
    robots(frame, left, app, world, paint);
}

/// Takes rows off the top of the remaining area.
fn top_of(area: &mut Rect, rows: u16) -> Rect {
    let rows = rows.min(area.height);
    let top = Rect { height: rows, ..*area };
    (area.y, area.height) = (area.y + rows, area.height - rows);
    top
}

/// Styles of highlights, with and without colour.
#[derive(Clone, Copy)]
struct Paint {
    colour: bool,
}

impl Paint {
    fn heading(self) -> Style {
        Style::new().add_modifier(Modifier::BOLD)
    }

    fn chosen(self, has_focus: bool) -> Style {
        match has_focus {
            true => Style::new().add_modifier(Modifier::REVERSED),
            false => Style::new().add_modifier(Modifier::BOLD),
        }
    }

    fn of(self, world: &World) -> Style {
        match (world.link, world.state.as_deref()) {
            (Link::Lost, _) => self.tinted(Color::Red),
            (Link::Here, Some("playing")) => Style::new(),
            (Link::Here | Link::Connecting, _) => self.tinted(Color::Yellow),
        }
    }

    fn tinted(self, colour: Color) -> Style {
        if self.colour { Style::new().fg(colour) } else { Style::new() }
    }
}

fn title(frame: &mut Frame<'_>, area: Rect, app: &App, worlds: &[World], paint: Paint) {
    let lost = worlds.iter().filter(|world| world.link == Link::Lost).count();
    let lost = if lost > 0 { format!(", {lost} lost") } else { String::new() };
    let noun = if worlds.len() == 1 { "world" } else { "worlds" };
    let text = format!(
        "{} {noun}{lost}; by {}, robots by {}",
        worlds.len(),
        app.world_order.name(),
        app.robot_order.name()
    );
    frame.render_widget(Paragraph::new(text).style(paint.heading()), area);
}

fn status(frame: &mut Frame<'_>, area: Rect, app: &App, worlds: &[World], paint: Paint) {
    let error = app.world(worlds).and_then(|world| world.error.as_deref());
    let line = match (&app.question, app.message.as_deref().or(error)) {
        (Some(question), _) => {
            let verb = if question.play { "play" } else { "pause" };
            // On a narrow screen the question is shown completely, the name perhaps not.
            Line::styled(format!("{verb}? y/n: {}", printable(&question.label)), paint.heading())
        }
        (None, Some(message)) => Line::styled(printable(message).into_owned(), paint.tinted(Color::Red)),
        (None, None) => Line::raw(KEYS),
    };
    frame.render_widget(Paragraph::new(line), area);
}

fn worlds(frame: &mut Frame<'_>, area: Rect, app: &App, worlds: &[World], paint: Paint) {
    let columns = fitting(area.width);
    let cell = |column: &WorldColumn, world: &World| cell(&(column.cell)(world), column.is_right);
    let rows = worlds
        .iter()
        .map(|world| Row::new(columns.iter().map(|column| cell(column, world))).style(paint.of(world)));
    let heading = Row::new(columns.iter().map(|column| self::cell(column.heading, column.is_right)));
    let widths = columns.iter().map(|column| Constraint::Length(width_of(column, area.width)));
    let table = Table::new(rows, widths)
        .row_highlight_style(paint.chosen(app.focus == Focus::Worlds))
        .header(heading.style(paint.heading()));
    let mut state = TableState::new().with_selected(app.world_row(worlds));
    frame.render_stateful_widget(table, area, &mut state);
}

/// Returns the width of a column: on a narrow screen, the name of a world leaves room for its state.
fn width_of(column: &WorldColumn, screen: u16) -> u16 {
    match column.rank {
        0 => screen.saturating_sub(11).clamp(1, column.width),
        _ => column.width,
    }
}

/// Returns the columns that fit, with one cell between two. The first is always included.
fn fitting(width: u16) -> Vec<&'static WorldColumn> {
    let mut ranked: Vec<&WorldColumn> = COLUMNS.iter().collect();
    ranked.sort_by_key(|column| column.rank);
    let mut left = width.saturating_add(1);
    let mut last = 0;
    for column in ranked {
        let Some(rest) = left.checked_sub(width_of(column, width) + 1) else { break };
        (left, last) = (rest, column.rank);
    }
    COLUMNS.iter().filter(|column| column.rank <= last).collect()
}

fn robots(frame: &mut Frame<'_>, area: Rect, app: &App, world: &World, paint: Paint) {
    let widths = [22, 5, 6, 10, 14, 20].map(Constraint::Length);
    let rows: Vec<_> = world.robots.iter().map(RobotRow::cells).collect();
    let table = table(&RobotRow::HEADINGS, rows, &widths, paint)
        .row_highlight_style(paint.chosen(app.focus == Focus::Robots));
    let mut state = TableState::new().with_selected(app.robot_row(world));
    frame.render_stateful_widget(table, area, &mut state);
}

fn clients(frame: &mut Frame<'_>, area: Rect, world: &World, paint: Paint) {
    let widths = [20, 9, 8, 7].map(Constraint::Length);
    let rows: Vec<_> = world.clients.iter().map(ClientRow::cells).collect();
    frame.render_widget(table(&ClientRow::HEADINGS, rows, &widths, paint), area);
}

fn table(
    headings: &'static [(&'static str, bool)],
    rows: Vec<Vec<String>>,
    widths: &[Constraint],
    paint: Paint,
) -> Table<'static> {
    let rows = rows
        .into_iter()
        .map(|cells| Row::new(cells.iter().zip(headings).map(|(text, (_, is_right))| cell(text, *is_right))));
    let heading = Row::new(headings.iter().map(|(text, is_right)| cell(text, *is_right)));
    Table::new(rows, widths.to_vec()).header(heading.style(paint.heading()))
}

fn cell(text: &str, is_right: bool) -> Text<'static> {
    let alignment = if is_right { Alignment::Right } else { Alignment::Left };
    // Several lines would be cut to the first one, so a line break is escaped too.
    Text::raw(printable(text).into_owned()).alignment(alignment)
}
