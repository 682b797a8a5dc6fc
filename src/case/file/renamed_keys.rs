//! Old names of keys and values, which are accepted until version 0.2.

use super::spanned_toml::SpannedValue;
use crate::case::error::{Diagnostics, SourceLocation};

/// The content of a TOML file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FileKind {
    Case,
    Material,
    Gas,
}

/// Kind of file, path of the table that has the key, old and new name of the key. `*` is every entry of a list.
pub(super) type KeyRow = (FileKind, &'static [&'static str], &'static str, &'static str);
/// Kind of file, path of the key under its new name, old and new value.
pub(super) type ValueRow = (FileKind, &'static [&'static str], &'static str, &'static str);

const REACTION: &[&str] = &["decomposition", "reaction", "*"];

pub(super) const KEYS: &[KeyRow] = &[
    (FileKind::Case, &["sensor", "*"], "lag", "time_constant"),
    (FileKind::Case, &["hot_face"], "coefficient", "heat_transfer_coefficient"),
    (FileKind::Case, &["back_face"], "coefficient", "heat_transfer_coefficient"),
    (FileKind::Case, &["estimate"], "loss", "loss_function"),
    (FileKind::Case, &["resolution"], "every", "output_interval"),
    (FileKind::Case, &["resolution"], "growth", "step_growth"),
    (FileKind::Case, &["resolution"], "largest_step", "max_step"),
    (FileKind::Material, &["pores"], "inertia", "forchheimer_coefficient"),
    (FileKind::Material, &["decomposition", "char", "pores"], "inertia", "forchheimer_coefficient"),
    (FileKind::Material, &["decomposition", "intermediate", "*", "pores"], "inertia", "forchheimer_coefficient"),
    (FileKind::Material, &["decomposition"], "sequence", "reaction_scheme"),
    (FileKind::Material, &["decomposition"], "mixing", "mixture_rule"),
    (FileKind::Material, REACTION, "loss", "mass_loss"),
    (FileKind::Material, REACTION, "rate", "pre_exponential"),
    (FileKind::Material, REACTION, "activation", "activation_energy"),
    (FileKind::Material, REACTION, "onset", "onset_temperature"),
    (FileKind::Gas, &["enthalpy"], "level", "kind"),
];

const PROPERTY: &[&str] = &["factor", "*", "property"];
const SCHEME: &[&str] = &["decomposition", "reaction_scheme"];

pub(super) const VALUES: &[ValueRow] = &[
    (FileKind::Case, PROPERTY, "loss", "back_face_loss"),
    (FileKind::Case, PROPERTY, "holder", "holder_loss"),
    (FileKind::Case, PROPERTY, "kinetics", "pre_exponential"),
    (FileKind::Case, PROPERTY, "contact", "contact_conductance"),
    (FileKind::Case, PROPERTY, "depth", "sensor_depth"),
    (FileKind::Material, SCHEME, "side-by-side", "parallel"),
    (FileKind::Material, SCHEME, "chain", "consecutive"),
];

/// Replace every old name in a document, and record it.
pub(super) fn replace_old_names(root: &mut SpannedValue, kind: FileKind, diagnostics: &Diagnostics) {
    for &(_, table, old, new) in KEYS.iter().filter(|(of, ..)| *of == kind) {
        root.visit(table, &mut |table| table.rename_key(old, new, diagnostics));
    }
    for &(_, key, old, new) in VALUES.iter().filter(|(of, ..)| *of == kind) {
        root.visit(key, &mut |value| value.rename_text(old, new, diagnostics));
    }
}

/// Replace an old name in the path of an override of a case, and record it.
pub(super) fn replace_in_path(path: &mut [&str], location: &SourceLocation, diagnostics: &Diagnostics) {
    for &(_, table, old, new) in KEYS.iter().filter(|(of, ..)| *of == FileKind::Case) {
        let Some((above, [key, ..])) = path.split_at_mut_checked(table.len()) else { continue };
        if *key == old && table.iter().zip(above).all(|(wanted, found)| *wanted == "*" || wanted == found) {
            diagnostics.record_renamed(location, old, new);
            *key = new;
        }
    }
}
