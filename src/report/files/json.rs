//! Serialisation of `summary.json`.

use crate::fit::proportion::Proportion;
use crate::report::ReportError;
use serde::Serialize;
use serde::ser::{SerializeMap, Serializer};
use serde_json::ser::PrettyFormatter;

type Json = serde_json::Serializer<Vec<u8>, PrettyFormatter<'static>>;

/// A JSON object being written; keys are in the order of the calls of [`JsonObject::put`].
pub(in crate::report) struct JsonObject<'a> {
    entries: <&'a mut Json as Serializer>::SerializeMap,
}

impl JsonObject<'_> {
    /// The JSON text of an object whose entries `put` writes.
    ///
    /// # Errors
    /// When JSON cannot be written.
    pub(in crate::report) fn to_json(
        put: impl FnOnce(&mut JsonObject<'_>) -> Result<(), ReportError>,
    ) -> Result<String, ReportError> {
        let mut json = Json::with_formatter(Vec::new(), PrettyFormatter::new());
        let mut record = JsonObject { entries: json.serialize_map(None)? };
        put(&mut record)?;
        record.entries.end()?;
        Ok(String::from_utf8(json.into_inner()).expect("JSON is text") + "\n")
    }

    /// Write a key and its value.
    ///
    /// # Errors
    /// When JSON cannot be written.
    pub(in crate::report) fn put<T: Serialize + ?Sized>(&mut self, key: &str, value: &T) -> Result<(), ReportError> {
        Ok(self.entries.serialize_entry(key, value)?)
    }
}

/// A map in the order of the case instead of alphabetical order.
pub(in crate::report) struct OrderedMap<'a, T>(pub(in crate::report) Vec<(&'a str, T)>);

impl<T: Serialize> Serialize for OrderedMap<'_, T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.0.len()))?;
        for (name, value) in &self.0 {
            map.serialize_entry(name, value)?;
        }
        map.end()
    }
}

/// A counted share with its binomial 95 % interval, where its members are independent.
#[derive(Serialize)]
pub(in crate::report) struct ProportionRecord {
    count: usize,
    of: usize,
    share: f64,
    interval: Option<(f64, f64)>,
}

impl ProportionRecord {
    pub(in crate::report) fn of(counted: Proportion) -> Self {
        Self::with_interval(counted, Some(counted.interval_95()))
    }

    /// The proportion, with its interval if the members are drawn independently of each other.
    pub(in crate::report) fn of_members(counted: Proportion, are_independent: bool) -> Self {
        Self::with_interval(counted, are_independent.then(|| counted.interval_95()))
    }

    pub(in crate::report) fn with_interval(counted: Proportion, interval: Option<(f64, f64)>) -> Self {
        Self { count: counted.count, of: counted.total, share: counted.fraction(), interval }
    }
}
