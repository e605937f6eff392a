//! Sliders and buttons, without a transport.

use super::super::testing::paused;
use super::*;
use crate::account::Account;
use crate::handle::CallContext;

fn slider(minimum: f64, maximum: f64, value: f64) -> ParameterKind {
    ParameterKind::Slider { minimum, maximum, value }
}

fn moved(name: &str, value: f64) -> ParameterChange {
    ParameterChange::Move { name: name.into(), value }
}

fn pressed(name: &str, times: u64) -> ParameterChange {
    ParameterChange::Press { name: name.into(), times }
}

/// Returns a handle with a slider `speed` from 0 to 2 at 1, and a button `go`.
fn board() -> SimHandle {
    let handle = paused();
    handle.add_parameter("speed", slider(0.0, 2.0, 1.0), NameTaken::Refuse).unwrap();
    handle.add_parameter("go", ParameterKind::Button { presses: 0 }, NameTaken::Refuse).unwrap();
    handle
}

fn kinds(handle: &SimHandle) -> Vec<(String, ParameterKind)> {
    handle.parameters().parameters.iter().map(|it| (it.name.to_string(), it.kind)).collect()
}

#[tokio::test]
async fn sliders_are_moved_and_buttons_count_their_presses() {
    let handle = board();
    let set = handle.set_parameters(&[moved("speed", 2.0), pressed("go", 3)]).unwrap();
    assert_eq!(set, handle.parameters().parameters);
    handle.set_parameters(&[pressed("go", u64::MAX)]).unwrap();
    let expected = [
        ("speed".to_owned(), slider(0.0, 2.0, 2.0)),
        ("go".into(), ParameterKind::Button { presses: u64::MAX }),
    ];
    assert_eq!(kinds(&handle), expected);
}

#[tokio::test]
async fn each_change_has_a_version_and_calls_without_a_change_have_none() {
    let handle = paused();
    assert_eq!(handle.parameters().version, 1);
    handle.add_parameter("speed", slider(0.0, 2.0, 1.0), NameTaken::Refuse).unwrap();
    handle.add_parameter("gain", slider(0.0, 2.0, 1.0), NameTaken::Refuse).unwrap();
    handle.set_parameters(&[moved("speed", 0.5), moved("gain", 0.5)]).unwrap();
    let versions = |handle: &SimHandle| {
        let list = handle.parameters();
        (list.version, list.parameters.iter().map(|it| it.version).collect::<Vec<_>>())
    };
    assert_eq!(versions(&handle), (4, vec![4, 4]));
    handle.set_parameters(&[moved("speed", 0.5), moved("gain", 0.6)]).unwrap();
    assert_eq!(versions(&handle), (5, vec![4, 5]));
    handle.set_parameters(&[moved("speed", 0.5)]).unwrap();
    assert_eq!(versions(&handle), (5, vec![4, 5]));
    handle.remove_parameters(&["speed".into()]).unwrap();
    assert_eq!(versions(&handle), (6, vec![5]));
    assert_eq!(handle.remove_parameters(&[]).unwrap(), ["gain"]);
    assert_eq!(handle.remove_parameters(&[]).unwrap(), [""; 0]);
    assert_eq!(versions(&handle), (7, vec![]));
}

#[tokio::test]
async fn one_wrong_change_refuses_all_of_them() {
    let handle = board();
    let before = handle.parameters();
    let wrong = [
        (moved("sped", 1.0), "there is no parameter \"sped\"; parameters are \"speed\", \"go\""),
        (moved("speed", 2.1), "changes[2].value is 2.1; it must be between 0 and 2 (parameter \"speed\")"),
        (
            moved("speed", f64::NAN),
            "changes[2].value is NaN; it must be between 0 and 2 (parameter \"speed\")",
        ),
        (moved("go", 1.0), "changes[2] is of \"go\", a button; it must be pressed, it has no value"),
        (
            pressed("speed", 1),
            "changes[2] is of \"speed\", a slider; it must be given a value, it cannot be pressed",
        ),
    ];
    for (change, sentence) in wrong {
        let refused = handle.set_parameters(&[moved("speed", 0.1), pressed("go", 1), change]);
        assert_eq!(refused.unwrap_err().to_string(), sentence);
        assert_eq!(handle.parameters(), before);
    }
    let refused = handle.remove_parameters(&["speed".into(), "sped".into()]).unwrap_err();
    assert!(matches!(refused, CallError::ParameterNotFound { name, .. } if name == "sped"));
    assert_eq!(handle.parameters(), before);
}

#[tokio::test]
async fn a_value_beyond_the_range_is_moved_into_it_when_the_slider_is_added() {
    let handle = paused();
    for (value, kept) in [(-9.0, -1.0), (0.5, 0.5), (9.0, 1.0)] {
        let added = handle.add_parameter("it", slider(-1.0, 1.0, value), NameTaken::Replace).unwrap();
        assert_eq!(added.kind, slider(-1.0, 1.0, kept));
    }
}

#[tokio::test]
async fn invalid_parameters_are_not_added() {
    let handle = paused();
    let (nan, inf) = (f64::NAN, f64::INFINITY);
    for (minimum, maximum, value) in [
        (nan, 1.0, 0.0),
        (0.0, nan, 0.0),
        (0.0, 1.0, nan),
        (-inf, 1.0, 0.0),
        (0.0, inf, 0.0),
        (0.0, 1.0, inf),
        (1.0, 1.0, 1.0),
        (2.0, 1.0, 1.0),
    ] {
        let refused = handle.add_parameter("it", slider(minimum, maximum, value), NameTaken::Refuse);
        assert!(matches!(refused, Err(CallError::InvalidValue { .. })), "{minimum} {maximum} {value}");
    }
    for name in ["", "two\nlines", "\x1b[31m", &"x".repeat(257)] {
        let refused = handle.add_parameter(name, slider(0.0, 1.0, 0.0), NameTaken::Refuse);
        assert!(matches!(refused, Err(CallError::InvalidValue { .. })), "{name:?}");
    }
    assert!(handle.parameters().parameters.is_empty());
    handle.add_parameter("\u{df} = 1, {}", slider(0.0, 1.0, 0.0), NameTaken::Refuse).unwrap();
}

#[tokio::test]
async fn a_taken_name_is_refused_replaced_or_changed_as_is_asked_for() {
    let handle = board();
    let other = slider(5.0, 6.0, 5.5);
    let refused = handle.add_parameter("speed", other, NameTaken::Refuse).unwrap_err();
    assert!(matches!(&refused, CallError::ParameterExists { name } if name == "speed"), "{refused}");
    for name in ["speed_1", "speed_2"] {
        assert_eq!(&*handle.add_parameter("speed", other, NameTaken::Rename).unwrap().name, name);
    }
    handle.add_parameter("speed", other, NameTaken::Replace).unwrap();
    let names: Vec<String> = kinds(&handle).into_iter().map(|(name, _)| name).collect();
    assert_eq!(names, ["speed", "go", "speed_1", "speed_2"], "it is in the old one's place");
    assert_eq!(kinds(&handle)[0].1, other);

    let long = "x".repeat(256);
    handle.add_parameter(&long, other, NameTaken::Rename).unwrap();
    let refused = handle.add_parameter(&long, other, NameTaken::Rename);
    assert!(matches!(refused, Err(CallError::InvalidValue { .. })));
}

#[tokio::test]
async fn there_are_never_more_than_the_limit_and_one_can_still_be_replaced() {
    let handle = paused();
    let limit = handle.info().limits.parameters;
    for number in 0..limit {
        handle.add_parameter(&number.to_string(), slider(0.0, 1.0, 0.0), NameTaken::Refuse).unwrap();
    }
    for taken in [NameTaken::Refuse, NameTaken::Rename] {
        let name = if taken == NameTaken::Rename { "0" } else { "one more" };
        let refused = handle.add_parameter(name, slider(0.0, 1.0, 0.0), taken);
        assert!(matches!(refused, Err(CallError::LimitExceeded { .. })));
    }
    handle.add_parameter("0", slider(0.0, 1.0, 0.0), NameTaken::Replace).unwrap();
    assert_eq!(handle.parameters().parameters.len(), limit as usize);
}

#[tokio::test]
async fn a_reader_that_waits_gets_the_newest_and_skips_what_was_between() {
    let handle = board();
    let seen = handle.parameters().version;
    let write = async {
        for value in [0.1, 0.2, 0.3] {
            handle.set_parameters(&[moved("speed", value)]).unwrap();
        }
    };
    let (read, ()) = tokio::join!(handle.next_parameters(seen, None), write);
    assert_eq!(read.unwrap().parameters[0].kind, slider(0.0, 2.0, 0.3));
    // The reader's version from before a restart may be larger.
    for version in [0, 1_000_000] {
        let read = handle.next_parameters(version, None).await.unwrap();
        assert_eq!(read, handle.parameters());
    }
}

#[tokio::test(start_paused = true)]
async fn waiting_in_vain_gives_what_there_is_and_draining_ends_it() {
    let handle = board();
    let list = handle.parameters();
    let waited = handle.next_parameters(list.version, Some(Duration::from_secs(60))).await.unwrap();
    assert_eq!(waited, list);
    let drain = async { handle.draining().cancel() };
    let (waited, ()) = tokio::join!(handle.next_parameters(list.version, None), drain);
    assert!(matches!(waited, Err(CallError::ShuttingDown)));
}

#[tokio::test]
async fn a_name_that_is_taken_gets_the_first_number_that_is_free_as_it_is_written() {
    let handle = paused();
    let add = |name: &str| {
        let button = ParameterKind::Button { presses: 0 };
        handle.add_parameter(name, button, NameTaken::Rename).unwrap().name.to_string()
    };
    let beyond = format!("go_{}0", u64::MAX);
    for name in ["go", "go_0", "go_02", "go_+4", "go_4x", "go_1", "go_3", "go_1_1", beyond.as_str()] {
        assert_eq!(add(name), name);
    }
    for expected in ["go_2", "go_4", "go_5"] {
        assert_eq!(add("go"), expected);
    }
    assert_eq!(add("go_1"), "go_1_2");
}

/// All others wait during the search for a name. Its excessive length is not found then.
#[tokio::test]
async fn no_name_is_searched_if_there_is_no_room() {
    let handle = paused();
    let button = ParameterKind::Button { presses: 0 };
    let long = "x".repeat(256);
    handle.add_parameter(&long, button, NameTaken::Refuse).unwrap();
    for number in 1..handle.info().limits.parameters {
        handle.add_parameter(&number.to_string(), button, NameTaken::Refuse).unwrap();
    }
    let refused = handle.add_parameter(&long, button, NameTaken::Rename).unwrap_err();
    assert!(matches!(refused, CallError::LimitExceeded { .. }), "{refused}");
}

/// Each counts while it exists; the process itself has no share.
#[tokio::test]
async fn a_client_has_a_share_of_the_parameters_and_of_the_bytes_of_their_names() {
    let handle = paused();
    let limits = handle.info().limits;
    let [one, other] =
        ["one", "other"].map(|name| handle.of_call(CallContext::of(Account::Token(name.into()))));
    let add = |handle: &SimHandle, name: &str, taken| {
        let added = handle.add_parameter(name, ParameterKind::Button { presses: 0 }, taken);
        added.map(drop).map_err(|refused| refused.to_string())
    };
    for number in 0..limits.parameters_of_client {
        add(&one, &number.to_string(), NameTaken::Refuse).unwrap();
    }
    for (name, taken) in [("more", NameTaken::Refuse), ("0", NameTaken::Rename)] {
        let refused = add(&one, name, taken).unwrap_err();
        assert_eq!(
            refused,
            "the number of parameters of the token of one would be 769, and the limit is 768"
        );
    }
    add(&one, "0", NameTaken::Replace).unwrap();
    one.remove_parameters(&["0".into()]).unwrap();
    add(&one, "more", NameTaken::Refuse).unwrap();
    one.remove_parameters(&[]).unwrap();

    let long = |number: usize| format!("{number:0>256}");
    let fitting = limits.parameter_bytes_of_client / 256;
    for number in 0..fitting {
        add(&other, &long(number), NameTaken::Refuse).unwrap();
    }
    let refused = add(&other, "x", NameTaken::Refuse).unwrap_err();
    assert_eq!(
        refused,
        "the bytes of the names of parameters of the token of other would be 131073, and the limit is 131072"
    );
    add(&other, &long(0), NameTaken::Replace).unwrap();
    add(&one, &long(fitting), NameTaken::Refuse).unwrap();
    add(&handle, "x", NameTaken::Refuse).unwrap();
}
