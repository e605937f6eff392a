//! Rules for all arguments of all commands: a negative number is a value, a quantity may have a unit, and
//! errors name arguments as typed.

use std::any::TypeId;
use std::ffi::OsString;
use std::sync::{Mutex, PoisonError};

use clap::builder::ValueParser;
use clap::{Arg, Command, Parser};

use crate::{mistakes, quantity};

/// Options and values of the present command: the name of a field, and its argument as typed.
static TYPED: Mutex<Vec<(String, String)>> = Mutex::new(Vec::new());

/// Parses the arguments, or prints the error and ends the process.
pub(crate) fn read<A: Parser>() -> A {
    match parse(std::env::args_os()) {
        Ok(arguments) => arguments,
        Err(error) => refuse::<A>(&error),
    }
}

/// Parses the arguments of a command, which is the present one from now on.
///
/// # Errors
/// Returns a sentence about a wrong argument.
#[cfg(feature = "mcp")]
pub(crate) fn command<A: Parser>(typed: Vec<OsString>) -> Result<A, String> {
    parse(typed.clone()).map_err(|error| {
        let text = mistakes::text(&error, &with_rules(A::command()), &typed, &error.to_string());
        text.trim_start_matches("error: ").to_owned()
    })
}

fn parse<A: Parser>(typed: impl IntoIterator<Item = OsString>) -> Result<A, clap::Error> {
    let command = with_rules(A::command());
    let matches = command.clone().try_get_matches_from(typed)?;
    let (mut of, mut found) = (&command, &matches);
    while let Some((name, inner)) = found.subcommand() {
        let Some(next) = of.find_subcommand(name) else { break };
        (of, found) = (next, inner);
    }
    *TYPED.lock().unwrap_or_else(PoisonError::into_inner) = of.get_arguments().map(names).collect();
    A::from_arg_matches(&matches)
}

/// Returns the name of an argument's field, and its form as typed.
fn names(arg: &Arg) -> (String, String) {
    let is_word = |name: &str| name.chars().all(|letter| letter.is_ascii_uppercase() || letter == '_');
    let typed = match (arg.get_long(), arg.get_value_names()) {
        (Some(long), _) => format!("--{long}"),
        (None, Some([name, ..])) if is_word(name) => name.to_string(),
        (None, _) => arg.get_id().as_str().to_ascii_uppercase(),
    };
    (arg.get_id().as_str().to_owned(), typed)
}

/// Returns the command with the rules applied to its arguments and subcommands.
fn with_rules(command: Command) -> Command {
    let command = command.mut_args(with_rules_of_values);
    let names: Vec<String> = command.get_subcommands().map(|inner| inner.get_name().to_owned()).collect();
    names.iter().fold(command, |command, name| command.mut_subcommand(name, with_rules))
}

fn with_rules_of_values(arg: Arg) -> Arg {
    if !arg.get_action().takes_values() {
        return arg;
    }
    // An argument that accepts a hyphen also accepts negative numbers.
    let arg = if arg.is_allow_hyphen_values_set() { arg } else { arg.allow_negative_numbers(true) };
    let is_number = arg.get_value_parser().type_id() == TypeId::of::<f64>();
    let name = arg.get_value_names().and_then(|names| names.first()).map(ToString::to_string);
    // A rate with a default is this program's own, and 0 would mean never.
    let is_own_rate = name.as_deref() == Some("HZ") && !arg.get_default_values().is_empty();
    match name.as_deref().and_then(quantity::Scalar::of_name).filter(|_| is_number) {
        Some(scalar) => arg.value_parser(ValueParser::new(move |text: &str| match scalar.read(text) {
            Ok(value) if is_own_rate && value <= 0.0 => Err("it must be above 0".to_owned()),
            read => read,
        })),
        None => arg,
    }
}

/// Prints the error, and ends the process with its code.
fn refuse<A: Parser>(error: &clap::Error) -> ! {
    if !error.use_stderr() {
        error.exit();
    }
    let styled = error.render();
    let has_colour = crate::output::has_colour(std::io::IsTerminal::is_terminal(&std::io::stderr()));
    let rendered = if has_colour { styled.ansi().to_string() } else { styled.to_string() };
    let typed: Vec<OsString> = std::env::args_os().collect();
    let text = mistakes::text(error, &with_rules(A::command()), &typed, &rendered);
    // If stderr is closed, the error cannot be reported.
    let _ = std::io::Write::write_all(&mut std::io::stderr(), text.as_bytes());
    std::process::exit(error.exit_code())
}

/// Renames the refused fields in a sentence of the daemon as they were typed.
pub(crate) fn renamed(sentence: &str, fields: impl IntoIterator<Item = String>) -> String {
    let typed = TYPED.lock().unwrap_or_else(PoisonError::into_inner);
    fields
        .into_iter()
        .filter(|field| !field.is_empty())
        .fold(sentence.to_owned(), |sentence, field| sentence.replace(&field, &typed_name(&field, &typed)))
}

/// Returns the argument of a request's field, by its path: the option or value itself, or its last word as a
/// part of one.
fn typed_name(field: &str, typed: &[(String, String)]) -> String {
    let words: Vec<&str> = field.split('.').map(|word| word.split('[').next().unwrap_or(word)).collect();
    let of = |word: &&str| typed.iter().find(|(name, _)| name == word).map(|(_, typed)| typed.clone());
    let Some((last, before)) = words.split_last() else { return field.to_owned() };
    let own = || last.replace('_', " ");
    // A positional value is preferred; an option of the same name may mean something else.
    let whole = before.iter().filter_map(of).min_by_key(|typed| typed.starts_with("--"));
    of(last).unwrap_or_else(|| match whole {
        Some(whole) => format!("{} of {whole}", own()),
        None => own(),
    })
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory as _;

    use super::*;
    use crate::commands::Arguments;

    fn refused(line: &str) -> String {
        let typed: Vec<OsString> = line.split(' ').map(OsString::from).collect();
        let error = parse::<Arguments>(typed.clone()).unwrap_err();
        mistakes::text(&error, &with_rules(Arguments::command()), &typed, &error.to_string())
    }

    #[test]
    fn a_negative_number_is_a_value_wherever_a_number_is() {
        for line in [
            "simctl robot load a.urdf --scale -1",
            "simctl joint properties arm elbow --damping -5",
            "simctl sim physics --rtf -1",
            "simctl sim physics --gravity -1,0,-9.81",
            "simctl parameter add speed -1 1 -0.5",
            "simctl claim take arm --lease -1",
        ] {
            parse::<Arguments>(line.split(' ').map(OsString::from)).unwrap();
        }
        let steps = refused("simctl sim step -5");
        assert!(
            steps.contains("invalid value '-5'") && steps.contains("a whole number, 0 or more"),
            "{steps}"
        );
    }

    #[test]
    fn invalid_numbers_are_refused_in_plain_words() {
        for line in [
            "simctl sim step many",
            "simctl sim step 99999999999999999999999",
            "simctl sim physics --time-step soon",
            "simctl joint watch arm --rate often",
            "simctl server ping --count 1.5",
            "simctl server ping --count 0",
            "simctl sim step 0",
            "simctl sim physics --substeps -2",
            "simctl claim take arm --priority -1",
        ] {
            let said = refused(line);
            for word in ["digit", "literal", "string", "target type", "..", "is not in"] {
                assert!(!said.contains(word), "{line}: {said}");
            }
        }
    }

    #[test]
    fn an_unknown_command_is_refused_with_those_that_there_are() {
        let said = refused("simctl sim set --gravity 0,0,-1");
        assert!(said.contains("commands here: status, play, pause, stop, step, reset, physics"), "{said}");
        let said = refused("simctl --timeout 1 physics --gravity 0,0,-1");
        assert!(said.contains("commands here: sim, robot, joint"), "{said}");
        assert!(said.contains("elsewhere: 'simctl sim physics'"), "{said}");
    }

    #[test]
    fn an_unknown_option_is_refused_with_those_that_there_are() {
        let said = refused("simctl record start x --state-rate 0");
        assert!(said.contains("options here: ") && said.contains("--max-bytes"), "{said}");
        assert!(!said.contains("as a value"), "{said}");
    }

    #[test]
    fn a_quantity_may_have_a_unit() {
        for line in [
            "simctl sim physics --time-step 1ms",
            "simctl joint watch arm --rate 0.1kHz",
            "simctl claim take arm --lease 2min",
            "simctl sim status --timeout 500ms",
        ] {
            parse::<Arguments>(line.split(' ').map(OsString::from)).unwrap();
        }
        let said = refused("simctl sim physics --time-step 1mm");
        assert!(said.contains("`1mm` is not a number without a unit or with one of"), "{said}");
    }

    #[test]
    fn a_watch_that_would_never_look_is_refused() {
        for rate in ["0", "-1"] {
            let said = refused(&format!("simctl joint watch arm --rate {rate}"));
            assert!(said.contains("it must be above 0"), "{said}");
        }
    }

    #[test]
    fn a_field_is_named_as_it_was_typed() {
        let typed = [("time_step".to_owned(), "--time-step".to_owned())];
        assert_eq!(typed_name("physics.time_step", &typed), "--time-step");
        assert_eq!(typed_name("robots[0].joints[0].position.position", &typed), "position");
        assert_eq!(typed_name("world.max_force[2]", &typed), "max force");
        let typed = [("pose".to_owned(), "--pose".to_owned())];
        assert_eq!(typed_name("sensor.pose.position.x", &typed), "x of --pose");
    }
}
