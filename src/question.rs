//! Questions to a case. A field of a question is an option of the command, a keyword of Python, a key of
//! `question.toml` and a field of the library: its comment is the help of all, and its default the one of `Default`.
//!
//! Values are in SI, with the unit at the end of the name. From outside a field has its name without the unit, and its
//! value is a text with a unit: `least_distance_m` is `--least-distance "0.5 mm"` (see `quantity.rs`).

mod design;
mod draw;
mod error;
mod estimate;
mod fit;
mod goal;
mod history;
mod named_case;
mod observed;
mod precision_target;
mod predict;
pub(crate) mod quantity;
mod record;
mod sensitivity;
mod size;
mod study;
mod trade;
mod twin;
mod uncertainty;

pub use design::Design;
pub use draw::Draw;
pub use error::InputError;
pub(crate) use error::{check_limit, is_positive};
pub use estimate::Estimate;
pub use fit::{Fit, Minimiser, PosteriorSampling, Prior};
pub use goal::Goal;
pub use history::History;
pub use named_case::NamedCase;
pub(crate) use named_case::distinct as named_cases;
pub use observed::ObservationSelection;
pub use predict::{Observations, Predict};
pub use quantity::FactorValue;
pub use record::{QuestionRecord, SessionRecord};
pub use sensitivity::{Derivatives, Sensitivity};
pub use size::{Limit, Requirement, Size};
pub use study::Study;
pub use trade::{PlyChoice, Trade};
pub use twin::Twin;
pub use uncertainty::Uncertainty;

use crate::case::{Case, CaseError};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use std::path::Path;

/// The kinds of questions, with the name of each, which is that of its command.
macro_rules! questions {
    ($($variant:ident $name:literal),*) => {
        /// A question to a case.
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        pub enum Question {
            $(
                #[doc = concat!("`", $name, "`")]
                #[serde(rename = $name)]
                $variant($variant),
            )*
        }

        impl Question {
            /// The names of all questions.
            pub const NAMES: &[&str] = &[$($name),*];

            /// `predict`, `uncertainty`, …
            pub fn name(&self) -> &'static str {
                match self {
                    $(Self::$variant(_) => $name,)*
                }
            }

            /// The question of a name, with all defaults.
            pub fn named(name: &str) -> Option<Self> {
                match name {
                    $($name => Some(Self::$variant($variant::default())),)*
                    _ => None,
                }
            }

            /// Check the question for a case, before any computation. The other cases that it names have been
            /// [read](Self::read_cases).
            ///
            /// # Errors
            /// When an option is wrong or without effect, or the case lacks what the question needs.
            pub fn check(&self, case: &Case) -> Result<(), InputError> {
                match self {
                    $(Self::$variant(question) => question.check(case),)*
                }
            }

            /// The fields by their outer names, with their values as texts, numbers and lists.
            pub fn fields(&self) -> Map<String, Value> {
                match self {
                    $(Self::$variant(question) => fields(question),)*
                }
            }
        }

        $(
            impl From<$variant> for Question {
                fn from(question: $variant) -> Self {
                    Self::$variant(question)
                }
            }
        )*
    };
}

questions!(
    Predict "predict",
    Observations "observations",
    Uncertainty "uncertainty",
    Sensitivity "sensitivity",
    Estimate "estimate",
    Study "study",
    Size "size",
    Trade "trade",
    Design "design",
    History "history",
    Twin "twin"
);

impl Question {
    /// The question of a name with these fields; the others have their defaults.
    ///
    /// # Errors
    /// When there is no such question or field, or a value is wrong.
    pub fn from_fields(name: &str, given: &Map<String, Value>) -> Result<Self, InputError> {
        let unknown = || format!("no question is called {name:?}; there are {}", Self::NAMES.join(", "));
        let known = Self::named(name).ok_or_else(|| InputError::general(unknown()))?.fields();
        if let Some(field) = given.keys().find(|field| !known.contains_key(*field)) {
            let all: Vec<&str> = known.keys().map(String::as_str).collect();
            let message = match all.is_empty() {
                true => format!(": {name} has no options"),
                false => format!(": {name} has no such option; it has {}", all.join(", ")),
            };
            return Err(InputError::for_option(field.clone(), message));
        }
        let read = |fields: &Map<String, Value>| {
            let question = Map::from_iter([(name.to_owned(), Value::Object(fields.clone()))]);
            Self::deserialize(Value::Object(question))
        };
        read(given).map_err(|error| {
            // A field that is wrong alone is the one at fault.
            let is_wrong = |(field, value): &(&String, &Value)| {
                read(&Map::from_iter([((*field).clone(), (*value).clone())])).is_err()
            };
            match given.iter().find(is_wrong) {
                Some((field, value)) => InputError::for_option(field.clone(), format!(" {value}: {error}")),
                None => InputError::general(error),
            }
        })
    }

    /// Read the other cases that the question names by their paths.
    ///
    /// # Errors
    /// The error of reading a case.
    pub fn read_cases(&mut self, mut read: impl FnMut(&Path) -> Result<Case, CaseError>) -> Result<(), CaseError> {
        let (others, compare) = match self {
            Self::Estimate(question) => (&mut question.others[..], question.compare.as_mut()),
            Self::Trade(question) => (&mut question.exposures[..], None),
            Self::Design(question) => (&mut question.others[..], None),
            _ => return Ok(()),
        };
        others.iter_mut().chain(compare).try_for_each(|case| case.read_with(&mut read))
    }
}

fn fields(question: &impl Serialize) -> Map<String, Value> {
    match serde_json::to_value(question) {
        Ok(Value::Object(fields)) => fields,
        _ => unreachable!("a question is a struct of texts, numbers and lists"),
    }
}

/// The first option of a group that differs from its default.
fn given_option<T: Serialize + Default>(group: &T) -> Option<String> {
    let (given, unchanged) = (fields(group), fields(&T::default()));
    given.into_iter().find(|(name, value)| unchanged.get(name) != Some(value)).map(|(name, _)| name)
}
