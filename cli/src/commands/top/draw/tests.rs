//! Pictures of recorded worlds, on screens of all sizes, before and after keys.

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

/// Returns a daemon that answered twice, one that is lost, and one that never answered.
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
    (0..height).map(|y| (0..width).map(|x| symbol(x, y)).collect::<String>().trim_end().to_owned()).collect()
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
    // Deleted robots are no longer chosen.
    worlds[0].robots.truncate(1);
    assert!(shows(&app, &worlds, "robot_0"));
}

#[test]
fn control_characters_are_written_out() {
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
    // Any key but y is a no, even one that ends the program elsewhere.
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
