//! Message types from the text of their definitions.

use crate::streams::Column;
use crate::streams::bytes::Kind;

/// Maximum length of an array that becomes columns.
const LONGEST: usize = 64;

/// Maximum nesting depth of types.
const DEEPEST: usize = 16;
/// Maximum number of fields of an instrument message.
const MOST_FIELDS: usize = 4096;

/// Serialisation of numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    Ros1,
    Cdr,
}

/// A field of a message.
pub struct Field {
    pub kind: FieldKind,
    pub many: Many,
}

/// Kinds of fields.
pub enum FieldKind {
    Number(Kind),
    Text,
    /// A time of seconds and nanoseconds.
    Time(Kind),
    Message(Vec<Field>),
}

/// Number of values of a field.
#[derive(Clone, Copy, PartialEq)]
pub enum Many {
    One,
    /// A fixed number.
    Fixed(usize),
    /// A number that each message states.
    Any,
}

impl Many {
    /// Whether the numbers of the field become columns.
    pub fn is_column(self) -> bool {
        match self {
            Self::One => true,
            Self::Fixed(size) => (1..=LONGEST).contains(&size),
            Self::Any => false,
        }
    }
}

/// The definitions used while a type is built.
pub struct Parser {
    /// Names and texts; the first is that of the message.
    definitions: Vec<(String, String)>,
    encoding: Encoding,
    pub columns: Vec<Column>,
    /// Fields so far.
    count: usize,
}

/// Position of a field in a message.
struct Place<'a> {
    path: &'a str,
    many: Many,
    /// Whether the numbers of the field become columns.
    is_column: bool,
    depth: usize,
}

impl Parser {
    /// A parser for a type and the text of its definition, followed by the definitions of the required types.
    pub fn new(name: &str, definition: &str, encoding: Encoding) -> Self {
        let mut definitions = vec![(name.replace("/msg/", "/"), String::new())];
        for line in definition.lines() {
            if line.starts_with("====") {
                definitions.push(Default::default());
            } else if let Some(name) = line.strip_prefix("MSG:") {
                if let Some(last) = definitions.last_mut() {
                    last.0 = name.trim().replace("/msg/", "/");
                }
            } else if let Some((_, text)) = definitions.last_mut() {
                text.push_str(line);
                text.push('\n');
            }
        }
        Self {
            definitions,
            encoding,
            columns: Vec::new(),
            count: 0,
        }
    }

    /// The fields of the message.
    pub fn message(&mut self) -> Result<Vec<Field>, String> {
        self.of_type(0, "", true, 0)
    }

    fn of_type(
        &mut self,
        place: usize,
        prefix: &str,
        is_column: bool,
        depth: usize,
    ) -> Result<Vec<Field>, String> {
        let (own, text) = self.definitions[place].clone();
        let package = own.split('/').next().unwrap_or_default();
        let mut fields = Vec::new();
        for line in text.lines() {
            let line = line.split('#').next().unwrap_or_default().trim();
            let mut words = line.split_whitespace();
            let (Some(kind), Some(name)) = (words.next(), words.next()) else {
                continue;
            };
            let constant =
                name.contains('=') || words.next().is_some_and(|next| next.starts_with('='));
            if constant {
                continue;
            }
            self.count += 1;
            if self.count > MOST_FIELDS || depth > DEEPEST {
                return Err(format!("more than {MOST_FIELDS} fields in `{own}`"));
            }
            let (kind, many) = match kind.split_once('[') {
                None => (kind, Many::One),
                Some((kind, size)) => match size.trim_end_matches(']') {
                    "" => (kind, Many::Any),
                    bounded if bounded.starts_with("<=") => (kind, Many::Any),
                    fixed => {
                        let size = fixed
                            .parse()
                            .map_err(|_| format!("a malformed field `{line}`"))?;
                        (kind, Many::Fixed(size))
                    }
                },
            };
            let place = Place {
                path: &format!("{prefix}{name}"),
                many,
                is_column: is_column && many.is_column(),
                depth,
            };
            let kind = self.field(package, kind, &place)?;
            fields.push(Field { kind, many });
        }
        Ok(fields)
    }

    fn field(&mut self, package: &str, kind: &str, place: &Place) -> Result<FieldKind, String> {
        let number = match kind {
            "byte" | "char" => "uint8",
            kind => kind,
        };
        if let Some(kind) = Kind::named(number) {
            self.add(place, unit(place.path));
            return Ok(FieldKind::Number(kind));
        }
        if kind == "string" || kind.starts_with("string<=") {
            return Ok(FieldKind::Text);
        }
        let full = match (kind, kind.contains('/')) {
            ("Header", _) => "std_msgs/Header".to_owned(),
            (_, true) => kind.replace("/msg/", "/"),
            (_, false) => format!("{package}/{kind}"),
        };
        let seconds = match (kind, &*full, self.encoding) {
            ("time", _, Encoding::Ros1) => Some(Kind::U32),
            ("duration", _, Encoding::Ros1) => Some(Kind::I32),
            (_, "builtin_interfaces/Time" | "builtin_interfaces/Duration", _) => Some(Kind::I32),
            _ => None,
        };
        if let Some(seconds) = seconds {
            self.add(place, "s");
            return Ok(FieldKind::Time(seconds));
        }
        let of = self.definitions.iter().position(|(name, _)| *name == full);
        let of = of.ok_or_else(|| format!("no definition of `{full}`"))?;
        let Place {
            path,
            many,
            is_column,
            depth,
        } = *place;
        let prefixes = match many {
            Many::Fixed(size) if is_column => {
                (0..size).map(|item| format!("{path}[{item}].")).collect()
            }
            _ => vec![format!("{path}.")],
        };
        // The items of a list share one definition; its columns are repeated for each item.
        let mut fields = Vec::new();
        for prefix in &prefixes {
            fields = self.of_type(of, prefix, is_column, depth + 1)?;
        }
        Ok(FieldKind::Message(fields))
    }

    fn add(&mut self, place: &Place, unit: &'static str) {
        let path = place.path;
        match place.many {
            _ if !place.is_column => {}
            Many::Fixed(size) => {
                let names = (0..size).map(|k| Column::new(format!("{path}[{k}]"), unit));
                self.columns.extend(names);
            }
            Many::One | Many::Any => self.columns.push(Column::new(path, unit)),
        }
    }
}

/// REP 103: SI.
fn unit(path: &str) -> &'static str {
    let of = |start: &str| {
        path.strip_prefix(start)
            .is_some_and(|rest| rest.starts_with('.'))
    };
    if of("angular_velocity") || path.contains(".angular_velocity.") {
        "rad/s"
    } else if of("linear_acceleration") || path.contains(".linear_acceleration.") {
        "m/s^2"
    } else {
        ""
    }
}
