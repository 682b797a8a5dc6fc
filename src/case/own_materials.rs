//! The material files beside a case.

/// The material files of a case.
#[derive(Clone, Debug, Default)]
pub(crate) struct OwnMaterials {
    /// Id of the material and path of the file, of those that a ply uses.
    pub(super) used: Vec<(String, String)>,
    /// Paths of the files in its folder of materials that no ply uses, by name.
    pub(super) unused: Vec<(String, String)>,
}
