//! Notes of the reader of a case: recorded channels, and data that are not read.

use super::error::Diagnostic;
use super::own_materials::OwnMaterials;
use super::pyrometer_driver::PyrometerDriver;
use super::recorded_channel::RecordedChannel;
use super::smoothed_driver::SmoothedDriver;

/// Notes on the files of a case. They are no part of its content: cases that differ in them only are equal.
#[derive(Clone, Debug, Default)]
pub(crate) struct ReadingNotes {
    /// Data that were not read.
    pub(super) unread: Vec<Diagnostic>,
    /// Recorded channel of each sensor.
    pub(crate) recorded: Vec<RecordedChannel>,
    /// Temperatures of held faces before they were smoothed.
    pub(super) drivers: Vec<SmoothedDriver>,
    /// The pyrometer that holds the hot face.
    pub(super) pyrometer_driver: Option<PyrometerDriver>,
    pub(super) materials: OwnMaterials,
}

impl PartialEq for ReadingNotes {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}
