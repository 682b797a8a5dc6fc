//! The material files beside a case.

use super::input_files::InputFile;
use super::material::Material;
use std::sync::Arc;

/// The material files of a case.
#[derive(Clone, Debug, Default)]
pub(crate) struct OwnMaterials {
    /// Id of the material and path of the file, of those that a ply uses.
    pub(super) used: Vec<(String, String)>,
    /// The files in its folder of materials that no ply uses.
    pub(super) unused: Vec<UnusedMaterial>,
}

/// A material file of a case that no ply uses: a candidate of a trade study.
#[derive(Clone, Debug)]
pub(super) struct UnusedMaterial {
    /// Name of the file, which is the id of the material.
    pub(super) name: String,
    /// Path of the file.
    pub(super) path: String,
    /// The material and the file that was read, or the errors of the file: they do not matter to a case without it.
    pub(super) read: Result<(Arc<Material>, InputFile), String>,
}
