//! The configuration file: TOML; an unknown key is a mistake.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glamx::{DPose3, DQuat, DVec3, EulerRot};
use serde::Deserialize;
use serde::de::IgnoredAny;
use simd_assets::files;
use toml::de::{DeTable, DeValue};

use super::draft::{Draft, Origin};
use super::key::Value;
use super::keys::{self, KEYS, TABLES};
use super::{ConfigError, Robot};

/// Maximum size of the file, bytes.
const MAX_BYTES: u64 = 16 << 20;

/// The part of a file that is not in the table of keys.
#[derive(Debug, Deserialize)]
struct Robots {
    #[serde(default)]
    robots: Vec<RobotTable>,
    #[serde(flatten)]
    _others: BTreeMap<String, IgnoredAny>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RobotTable {
    path: PathBuf,
    #[serde(default)]
    name: String,
    #[serde(default)]
    xyz: [f64; 3],
    #[serde(default)]
    rpy: [f64; 3],
    fixed: Option<bool>,
    #[serde(default)]
    passive: bool,
    #[serde(default)]
    positions: BTreeMap<String, f64>,
    scale: Option<f64>,
    #[serde(default)]
    strict: bool,
}

/// Example of a robot in a file.
pub(super) const ROBOT: &str = r#"[[robots]]
path = "/srv/robots/arm"        # required: a .urdf, or a package's folder
name = "arm"
xyz = [0, 0, 0]                 # metres
rpy = [0, 0, 0]                 # radians, as in URDF
fixed = true                    # left out: fixed if the root link is called world or has a plane
passive = false                 # whether joints have no actuators, instead of holding their positions
positions = { shoulder = 0.5 }  # rad or m
scale = 1.0
strict = false                  # whether to refuse the robot if its report has a warning
"#;

/// Returns the keys of a table, by their names in it; for an empty name, the keys above all tables.
pub(super) fn names(table: &str) -> Vec<&'static str> {
    KEYS.iter()
        .map(super::key::Key::table_and_name)
        .filter(|(of, _)| *of == table)
        .map(|(_, name)| name)
        .collect()
}

/// Reads a file and applies it to the draft. Relative paths begin at its folder.
pub(super) fn apply(draft: &mut Draft, path: &Path) -> Result<(), ConfigError> {
    let mistake = |sentence: String| ConfigError::File(format!("{}: {sentence}", path.display()));
    let text =
        files::read_text(path, MAX_BYTES).map_err(|error| mistake(format!("cannot be read: {error}")))?;
    let table = DeTable::parse(&text).map_err(|error| mistake(sentence(&text, &error)))?;
    let mut said = BTreeMap::new();
    read_table("", table.get_ref(), &text, &mut said).map_err(mistake)?;
    draft.folder = path.parent().unwrap_or(Path::new(".")).to_owned();
    for key in KEYS.iter() {
        if let Some((value, line)) = said.remove(key.path) {
            draft.set(key, value, Origin::File(path.to_owned(), line))?;
        }
    }
    let robots: Robots = toml::from_str(&text).map_err(|error| mistake(sentence(&text, &error)))?;
    for robot in robots.robots {
        let robot = robot.placed(&draft.folder).map_err(mistake)?;
        draft.config.robots.push(robot);
    }
    draft.folder = PathBuf::new();
    Ok(())
}

type Said = BTreeMap<String, (Value, usize)>;

/// Reads the values of a table and their lines. The error is the rest of a sentence that begins with the
/// file's name.
fn read_table(table: &str, entries: &DeTable<'_>, text: &str, said: &mut Said) -> Result<(), String> {
    for (name, entry) in entries {
        let line = line_of(text, name.span().start);
        let name = name.get_ref();
        let path = if table.is_empty() { name.to_string() } else { format!("{table}.{name}") };
        let is_table = TABLES.iter().any(|(table, _)| *table == path);
        match entry.get_ref() {
            DeValue::Table(entries) if is_table => read_table(&path, entries, text, said)?,
            DeValue::Array(_) | DeValue::Table(_) if path == "robots" => {}
            _ if is_table => return Err(format!("line {line}: {path} is a table, as [{path}]")),
            value if keys::find(&path).is_some() => {
                said.insert(path, (read_value(value), line));
            }
            _ => {
                let tables = TABLES.iter().filter(|(of, _)| table.is_empty() && !of.is_empty());
                let tables = tables
                    .map(|(of, _)| format!("[{of}]"))
                    .chain(table.is_empty().then(|| "[[robots]]".to_owned()));
                let known: Vec<String> = names(table).into_iter().map(str::to_owned).chain(tables).collect();
                let whose = if table.is_empty() { "there are" } else { "the table has" };
                return Err(format!("line {line}: there is no key {path}; {whose} {}", known.join(", ")));
            }
        }
    }
    Ok(())
}

fn read_value(value: &DeValue<'_>) -> Value {
    match value {
        DeValue::String(text) => Value::Text(text.to_string()),
        DeValue::Boolean(switch) => Value::Switch(*switch),
        DeValue::Integer(integer) => {
            let whole = i128::from_str_radix(integer.as_str(), integer.radix());
            whole.map_or(Value::Other("a number that is too large"), Value::Whole)
        }
        DeValue::Float(float) => {
            float.as_str().parse().map_or(Value::Other("a number that cannot be read"), Value::Number)
        }
        DeValue::Array(parts) => Value::List(parts.iter().map(|part| read_value(part.get_ref())).collect()),
        DeValue::Datetime(_) => Value::Other("a time"),
        DeValue::Table(_) => Value::Other("a table"),
    }
}

fn line_of(text: &str, at: usize) -> usize {
    text.get(..at).unwrap_or(text).matches('\n').count() + 1
}

/// Returns the line, the key, and the mistake.
fn sentence(text: &str, error: &toml::de::Error) -> String {
    let message = error.message().split_whitespace().collect::<Vec<_>>().join(" ");
    // Serde has words for programmers.
    let message = match message.strip_prefix("missing field ") {
        Some(field) => format!("the table [[robots]] lacks the key {field}"),
        None => {
            message.replace("expected f64", "expected a number").replace("unknown field", "there is no key")
        }
    };
    let Some(span) = error.span() else { return message };
    let number = line_of(text, span.start);
    let line = text.lines().nth(number - 1).unwrap_or_default();
    match line.split_once('=').map(|(key, _)| key.trim()) {
        Some(key) if !message.contains(&format!("`{key}`")) => format!("line {number}: {key}: {message}"),
        _ => format!("line {number}: {message}"),
    }
}

impl RobotTable {
    fn placed(self, folder: &Path) -> Result<Robot, String> {
        let numbers = self.xyz.iter().chain(&self.rpy).chain(self.positions.values()).chain(&self.scale);
        if let Some(number) = numbers.copied().find(|number| !number.is_finite()) {
            let path = self.path.display();
            return Err(format!("robot {path}: {number} in xyz, rpy, positions or scale; it must be finite"));
        }
        // The rpy of URDF: rotations about the fixed axes x, then y, then z.
        let [roll, pitch, yaw] = self.rpy;
        let rotation = DQuat::from_euler(EulerRot::ZYX, yaw, pitch, roll);
        Ok(Robot {
            path: folder.join(self.path),
            name: self.name,
            pose: DPose3::from_parts(DVec3::from(self.xyz), rotation),
            fixed: self.fixed,
            passive: self.passive,
            positions: self.positions,
            scale: self.scale.unwrap_or(1.0),
            strict: self.strict,
        })
    }
}
