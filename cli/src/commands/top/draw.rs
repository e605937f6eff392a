//! The picture of `simctl top`. Names and errors are from others: what a terminal would obey is written out.

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
/// A screen that is lower has the worlds alone.
const MIN_WITH_DETAILS: u16 = 9;
/// A screen that is narrower has no clients beside its robots.
const MIN_WITH_CLIENTS: u16 = 100;
const CLIENTS_WIDTH: u16 = 48;

/// Draws all of it, on a screen of any size.
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

/// Takes rows off the top of what is left.
fn top_of(area: &mut Rect, rows: u16) -> Rect {
    let rows = rows.min(area.height);
    let top = Rect { height: rows, ..*area };
    (area.y, area.height) = (area.y + rows, area.height - rows);
    top
}

/// What stands out, with colour and without.
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
            // The question is there whole on a narrow screen, the name perhaps not.
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

/// On a narrow screen the name of a world leaves room for its state.
fn width_of(column: &WorldColumn, screen: u16) -> u16 {
    match column.rank {
        0 => screen.saturating_sub(11).clamp(1, column.width),
        _ => column.width,
    }
}

/// The columns that there is room for, with one cell between two. The first is always there.
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
    // Several lines would be cut to the first one: a line break is written out, too.
    Text::raw(printable(text).into_owned()).alignment(alignment)
}

#[cfg(test)]
mod tests {
    use std::time::Instant;

    use ratatui::{
        Terminal,
        backend::TestBackend,
        crossterm::event::{KeyCode, KeyEvent},
    };
    use simd_client::proto::{ClientInfo, EntityInfo, ListClientsResponse, TargetSource};

    use super::super::app::{Effect, Question};
    use super::super::world::tests::answer;
    use super::*;

    fn robot(name: &str, joints: u32) -> EntityInfo {
        EntityInfo { name: name.into(), moving_joints: joints, mass: 2.5, ..Default::default() }
    }

    /// A daemon that answered twice, one that is lost, one that was never there.
    fn recorded(robots: Vec<EntityInfo>) -> Vec<World> {
        let begin = Instant::now();
        let mut lab = World::new("127.0.0.1:7400".into());
        lab.name = Some("lab".into());
        lab.answered(answer(begin, 0.0, 1_000, 100));
        let mut second = answer(begin, 1.0, 2_000, 350);
        let client = ClientInfo { name: "planner".into(), transport: "zenoh".into(), ..Default::default() };
        let target = TargetSource { client: "planner".into(), ..Default::default() };
        let clients = ListClientsResponse { clients: vec![client], targets: vec![target.clone(), target] };
        second.details = Some((robots, clients));
        lab.answered(second);
        let mut sea = World::new("sea:7400".into());
        sea.name = Some("sea".into());
        sea.lost("no daemon answers at sea:7400\x1b[2J".into());
        vec![lab, sea, World::new("tcp/moon:7447".into())]
    }

    fn picture((width, height): (u16, u16), app: &App, worlds: &[World]) -> Vec<String> {
        let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
        terminal.draw(|frame| draw(frame, app, worlds, true)).unwrap();
        let buffer = terminal.backend().buffer();
        let symbol = |x, y| buffer.cell((x, y)).unwrap().symbol().to_owned();
        (0..height)
            .map(|y| (0..width).map(|x| symbol(x, y)).collect::<String>().trim_end().to_owned())
            .collect()
    }

    fn press(app: &mut App, worlds: &mut [World], code: KeyCode) -> Effect {
        app.sort(worlds);
        app.key(KeyEvent::from(code), worlds)
    }

    #[test]
    fn a_wide_screen_has_worlds_robots_and_clients() {
        let worlds = recorded(vec![robot("arm", 6), robot("leg", 3)]);
        let lines = picture((200, 20), &App::default(), &worlds);
        let text = lines.join("\n");
        assert_eq!(lines[0], "3 worlds, 1 lost; by as found, robots by as loaded");
        for column in &COLUMNS {
            assert!(lines[1].contains(column.heading), "{}: {text}", column.heading);
        }
        let words: Vec<&str> = lines[2].split_whitespace().collect();
        let expected = [
            "lab",
            "playing",
            "1.00",
            "1000",
            "0.050",
            "<1",
            "0.020",
            "<1",
            "2",
            "0.250",
            "3",
            "250.0",
            "4",
            "1",
            "64",
            "MiB",
            "127.0.0.1:7400",
        ];
        assert_eq!(words, expected, "{text}");
        assert!(lines[3].starts_with("sea                  lost"), "{text}");
        assert!(lines[4].starts_with("tcp/moon:7447        connecting"), "{text}");
        let row = lines.iter().find(|line| line.starts_with("arm")).unwrap();
        assert!(row.contains('6') && row.contains("2.500"), "{text}");
        assert!(text.contains("planner") && text.contains("zenoh"), "{text}");
        assert_eq!(lines[19], KEYS);
    }

    #[test]
    fn a_small_screen_has_what_matters_most_and_none_is_too_small() {
        let mut app = App::default();
        let mut worlds = recorded((0..500).map(|number| robot(&format!("robot_{number}"), 1)).collect());
        let lines = picture((20, 5), &app, &worlds);
        assert_eq!(
            (&*lines[1], &*lines[2], &*lines[3]),
            ("WORLD     STATE", "lab       playing", "sea       lost")
        );
        let lines = picture((45, 5), &app, &worlds);
        assert!(lines[2].starts_with("lab                  playing"), "{lines:?}");
        press(&mut app, &mut worlds, KeyCode::Char('p'));
        let lines = picture((20, 5), &app, &worlds);
        assert_eq!(lines[4], "pause? y/n: lab");
        for width in 0..24 {
            for height in 0..14 {
                picture((width, height), &app, &worlds);
                picture((width, height), &app, &[]);
            }
        }
    }

    #[test]
    fn the_chosen_one_of_500_robots_is_on_the_screen() {
        let mut app = App::default();
        let mut worlds = recorded((0..500).map(|number| robot(&format!("robot_{number}"), 1)).collect());
        let shows = |app: &App, worlds: &[World], name: &str| {
            picture((120, 24), app, worlds).iter().any(|line| line.split_whitespace().next() == Some(name))
        };
        assert!(shows(&app, &worlds, "robot_0") && !shows(&app, &worlds, "robot_499"));
        press(&mut app, &mut worlds, KeyCode::Tab);
        press(&mut app, &mut worlds, KeyCode::End);
        assert!(shows(&app, &worlds, "robot_499") && !shows(&app, &worlds, "robot_0"));
        press(&mut app, &mut worlds, KeyCode::PageUp);
        press(&mut app, &mut worlds, KeyCode::Up);
        assert_eq!(app.robot_row(&worlds[0]), Some(488));
        // Those that are gone are not chosen any more.
        worlds[0].robots.truncate(1);
        assert!(shows(&app, &worlds, "robot_0"));
    }

    #[test]
    fn what_a_terminal_obeys_is_written_out() {
        let mut app = App::default();
        let mut worlds = recorded(vec![robot("a\x1b[31m\u{202e}b\nc", 1), robot("肩", 1)]);
        worlds[0].name = Some("l\u{9b}ab".into());
        let mut seen = picture((200, 20), &app, &worlds).join("\n");
        press(&mut app, &mut worlds, KeyCode::Down);
        seen += &picture((200, 20), &app, &worlds).join("\n");
        assert!(seen.replace('\n', "").chars().all(simd_client::is_printable), "{seen:?}");
        for escaped in [r"a\u{1b}[31m\u{202e}b", r"l\u{9b}ab", r"\u{1b}[2J", "肩"] {
            assert!(seen.contains(escaped), "{escaped}: {seen}");
        }
    }

    #[test]
    fn a_world_is_paused_after_a_question_alone() {
        let mut app = App::default();
        let mut worlds = recorded(Vec::new());
        let question = Question { endpoint: "127.0.0.1:7400".into(), label: "lab".into(), play: false };
        assert_eq!(press(&mut app, &mut worlds, KeyCode::Char('p')), Effect::Nothing);
        assert_eq!(app.question, Some(question.clone()));
        // Any key but y is a no, also one that ends the program elsewhere.
        assert_eq!(press(&mut app, &mut worlds, KeyCode::Char('q')), Effect::Nothing);
        assert_eq!(press(&mut app, &mut worlds, KeyCode::Char('y')), Effect::Nothing);
        press(&mut app, &mut worlds, KeyCode::Char('p'));
        assert_eq!(press(&mut app, &mut worlds, KeyCode::Char('y')), Effect::Do(question));
        worlds[0].state = Some("paused".into());
        press(&mut app, &mut worlds, KeyCode::Char('p'));
        assert!(app.question.take().unwrap().play);
        press(&mut app, &mut worlds, KeyCode::Down);
        press(&mut app, &mut worlds, KeyCode::Char('p'));
        assert_eq!((&app.question, app.message.as_deref()), (&None, Some("sea does not answer")));
        assert_eq!(press(&mut app, &mut worlds, KeyCode::Char('q')), Effect::Quit);
        assert_eq!(press(&mut app, &mut [], KeyCode::Char('p')), Effect::Nothing);
        assert_eq!(press(&mut app, &mut [], KeyCode::Down), Effect::Nothing);
    }

    #[test]
    fn sorting_keeps_the_chosen_world_and_robot() {
        let mut app = App::default();
        let mut worlds = recorded(vec![robot("leg", 3), robot("arm", 6)]);
        worlds.reverse();
        press(&mut app, &mut worlds, KeyCode::End);
        assert_eq!(app.world(&worlds).unwrap().label(), "lab");
        for first in ["lab", "lab", "lab"] {
            press(&mut app, &mut worlds, KeyCode::Char('s'));
            app.sort(&mut worlds);
            assert_eq!((worlds[0].label(), app.world(&worlds).unwrap().label()), (first, "lab"));
        }
        press(&mut app, &mut worlds, KeyCode::Tab);
        press(&mut app, &mut worlds, KeyCode::Down);
        let chosen = |app: &App, worlds: &[World]| {
            let world = app.world(worlds).unwrap();
            world.robots[app.robot_row(world).unwrap()].name.clone()
        };
        assert_eq!(chosen(&app, &worlds), "arm");
        press(&mut app, &mut worlds, KeyCode::Char('s'));
        app.sort(&mut worlds);
        let world = app.world(&worlds).unwrap();
        assert_eq!((world.robots[0].name.as_str(), chosen(&app, &worlds)), ("arm", "arm".to_owned()));
    }
}
