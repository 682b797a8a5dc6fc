//! Further cases of a question.

use super::error::InputError;
use crate::case::{Case, CaseError};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::path::{Path, PathBuf};

/// A case that a question names: by its path, until it is read, or as a value.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedCase {
    path: PathBuf,
    case: Option<Box<Case>>,
}

impl NamedCase {
    /// The path of the case; empty for one that was made from values.
    pub fn path(&self) -> &Path {
        &self.path
    }

    pub(super) fn read_with(
        &mut self,
        read: &mut dyn FnMut(&Path) -> Result<Case, CaseError>,
    ) -> Result<(), CaseError> {
        if self.case.is_none() {
            self.case = Some(Box::new(read(&self.path)?));
        }
        Ok(())
    }

    /// The case, once it was read.
    pub(crate) fn case(&self) -> Result<&Case, InputError> {
        let unread =
            || InputError::general(format!("the case {:?} was not read: call Question::read_cases", self.path));
        self.case.as_deref().ok_or_else(unread)
    }
}

impl From<Case> for NamedCase {
    fn from(case: Case) -> Self {
        let path = case.input_files().first().map_or_else(PathBuf::new, |file| PathBuf::from(&file.path));
        Self { path, case: Some(Box::new(case)) }
    }
}

impl From<PathBuf> for NamedCase {
    fn from(path: PathBuf) -> Self {
        Self { path, case: None }
    }
}

/// A file has the absolute path.
impl Serialize for NamedCase {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let path = std::path::absolute(&self.path).unwrap_or_else(|_| self.path.clone());
        serializer.collect_str(&path.display())
    }
}

impl<'de> Deserialize<'de> for NamedCase {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        PathBuf::deserialize(deserializer).map(Self::from)
    }
}

/// The value of an argument.
#[cfg(feature = "command")]
pub(super) fn parser() -> impl clap::builder::TypedValueParser<Value = NamedCase> {
    use clap::builder::{PathBufValueParser, TypedValueParser};
    PathBufValueParser::new().map(NamedCase::from)
}

/// Cases, each of another id.
pub(crate) fn distinct<'a>(case: &'a Case, others: &'a [NamedCase]) -> Result<Vec<&'a Case>, InputError> {
    let mut cases = vec![case];
    for other in others {
        let other = other.case()?;
        if cases.iter().any(|known| known.id == other.id) {
            return Err(InputError::general(format!("two cases have the id {:?}: give each case once", other.id)));
        }
        cases.push(other);
    }
    Ok(cases)
}
