//! The layup: plies from hot face to back face, and the sensors in them.

use super::material::Material;
use super::pyrometer::Pyrometer;
use super::validation::{FieldPath, UniqueNames, checked_name, not_negative, positive};
use crate::limits::{PLIES, THICKNESS_RATIO};
use std::sync::Arc;

/// Depths closer than this to the face of a ply lie on it: thicknesses are not known to a micrometre.
pub(super) const DEPTH_TOLERANCE_M: f64 = 1e-6;
/// The tolerance of a depth as a share of the thinner ply beside the face: a film of metal is thinner than a
/// micrometre.
const DEPTH_TOLERANCE: f64 = 1e-3;

/// Millimetres, rounded to a tenth of a micrometre for messages.
pub(super) fn rounded_mm(depth_m: f64) -> f64 {
    (depth_m * 1e7).round() / 1e4
}

/// A layer of one material.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Ply {
    /// Unique name: `INS1`.
    pub name: String,
    /// The plies that share scale factors: `OF`, `INS`, `GB` in the paper.
    pub group: String,
    /// Material of the ply.
    pub material: Arc<Material>,
    /// Thickness, above zero, m.
    pub thickness_m: f64,
}

impl Ply {
    /// Whether `group` is its group or its name.
    pub(super) fn belongs_to(&self, group: &str) -> bool {
        self.group == group || self.name == group
    }

    /// Whether it decomposes and so produces gas.
    pub(super) fn decomposes(&self) -> bool {
        self.material.decomposition.is_some()
    }

    fn check(&self, at: &FieldPath<'_>) {
        at.name("name", &self.name);
        at.name("group", &self.group);
        at.positive("thickness_m", self.thickness_m);
        self.material.check(&at.child("material"));
    }
}

/// Plies from hot face to back face.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Layup {
    /// The plies from the hot face to the back face, at least one.
    pub plies: Vec<Ply>,
    /// Contact conductance of each interface, one fewer than plies, W/m²/K; `None` for perfect contact.
    pub contacts_w_m2_k: Vec<Option<f64>>,
    /// Depth of the first marched face below the hot face, m: above zero if that face is held at a thermocouple in
    /// depth. `plies` are then those below it, the first with its remaining thickness.
    pub origin_m: f64,
}

impl Layup {
    /// Depth of the back face below the hot face, m.
    pub fn back_m(&self) -> f64 {
        self.origin_m + self.plies.iter().map(|ply| ply.thickness_m).sum::<f64>()
    }

    /// Depth of the lower face of each ply below the hot face, m.
    pub fn faces_m(&self) -> Vec<f64> {
        self.plies
            .iter()
            .scan(self.origin_m, |depth_m, ply| {
                *depth_m += ply.thickness_m;
                Some(*depth_m)
            })
            .collect()
    }

    /// Depth of each interface between two plies below the hot face, m.
    pub fn interfaces_m(&self) -> Vec<f64> {
        let mut depths_m = self.faces_m();
        depths_m.pop();
        depths_m
    }

    /// How close to the lower face of a ply a depth lies on it, m.
    fn close_to_face_m(&self, ply: usize) -> f64 {
        let beside = &self.plies[ply..(ply + 2).min(self.plies.len())];
        beside.iter().map(|ply| DEPTH_TOLERANCE * ply.thickness_m).fold(DEPTH_TOLERANCE_M, f64::min)
    }

    /// How close to the back face a depth lies on it, m.
    pub(super) fn close_to_back_m(&self) -> f64 {
        self.close_to_face_m(self.plies.len() - 1)
    }

    /// The depth of a close ply face, else the depth itself, m.
    pub(super) fn snap_to_face_m(&self, depth_m: f64) -> f64 {
        let faces_m = self.faces_m();
        let near = |&(ply, face_m): &(usize, &f64)| (face_m - depth_m).abs() <= self.close_to_face_m(ply);
        faces_m.iter().enumerate().find(near).map_or(depth_m, |(_, &face_m)| face_m)
    }

    /// A depth within the layup, moved onto a close face, m.
    pub(super) fn checked_depth_m(&self, depth_m: f64) -> Result<f64, String> {
        let (top_m, back_m) = (self.origin_m, self.back_m());
        if depth_m < top_m || depth_m > back_m + self.close_to_back_m() {
            let [depth, top, back] = [depth_m, top_m, back_m].map(rounded_mm);
            return Err(format!("depth {depth} mm lies outside the layup, from {top} mm to {back} mm"));
        }
        Ok(self.snap_to_face_m(depth_m))
    }

    /// The part of the layup below a depth, which lies above the back face.
    pub(super) fn part_below(self, depth_m: f64) -> Self {
        let faces_m = self.faces_m();
        let gone = faces_m.iter().filter(|&&face_m| face_m <= depth_m).count();
        let top_m = if gone == 0 { 0.0 } else { faces_m[gone - 1] };
        let mut plies = self.plies;
        plies.drain(..gone);
        // At the face of a ply its thickness stays the same to the bit.
        if depth_m > top_m {
            plies[0].thickness_m = faces_m[gone] - depth_m;
        }
        let contacts_w_m2_k = self.contacts_w_m2_k[gone..].to_vec();
        Self { plies, contacts_w_m2_k, origin_m: depth_m }
    }

    /// Whether a ply is thick enough for the layup: depths within a millionth of it are equal on the grid.
    fn checked_ply_thickness_m(&self, ply: &Ply) -> Result<(), String> {
        // With what lies above a held face, as depths are measured from the face of the whole layup.
        let thickness_m = self.back_m();
        THICKNESS_RATIO
            .check(thickness_m / ply.thickness_m)
            .map_err(|message| format!("{message} with a ply of {} m in a layup of {thickness_m} m", ply.thickness_m))
    }

    /// Record all errors of the fields. Returns whether the depths of the faces are known.
    pub(super) fn check(&self, at: &FieldPath<'_>) -> bool {
        let mut names = UniqueNames::new("ply");
        for (at, ply) in at.child("plies").elements(&self.plies) {
            ply.check(&at);
            at.child("name").require(names.insert(&ply.name));
            at.child("thickness_m").require(self.checked_ply_thickness_m(ply));
        }
        // Factors, trade studies and reports name a material by its id.
        for (index, (at, ply)) in at.child("plies").elements(&self.plies).enumerate() {
            let same = |other: &&Ply| ply.material.is_other_of_one_name(&other.material);
            if let Some(other) = self.plies[..index].iter().find(same) {
                let (id, other) = (&ply.material.id, &other.name);
                at.child("material.id").error(format!("{id:?} is the name of another material, that of ply {other:?}"));
            }
        }
        at.child("plies").require(PLIES.check(self.plies.len() as f64));
        let contacts = at.child("contacts_w_m2_k");
        contacts.require_each(&self.contacts_w_m2_k, |contact| {
            contact.map(|contact_w_m2_k| positive(contact_w_m2_k, contact_w_m2_k)).transpose()
        });
        let (requested, found) = (self.plies.len().saturating_sub(1), self.contacts_w_m2_k.len());
        if found != requested {
            contacts.error(format!("expected a contact for each of {requested} interfaces, found {found}"));
        }
        at.not_negative("origin_m", self.origin_m);
        if self.plies.is_empty() {
            at.child("plies").error("no ply: expected at least one");
        }
        !self.plies.is_empty() && self.back_m().is_finite() && found == requested
    }
}

/// A thermocouple at a depth, or a pyrometer that looks at the hot face.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Sensor {
    /// Unique name, used in column headings: letters, digits, `_`, `-` and `.`.
    pub name: String,
    /// Depth below the hot face, m. A depth within a micrometre of an interface, and within a thousandth of the thinner
    /// ply beside it, is moved onto it; `side` then selects the ply.
    pub depth_m: f64,
    /// Side of the interface; without effect inside a ply.
    pub side: Side,
    /// Time constant of the first-order lag of the bead, s; 0 for none.
    pub time_constant_s: f64,
    /// The pyrometer, which reads a brightness temperature; `None` for a thermocouple. Its depth and lag are 0.
    pub pyrometer: Option<Pyrometer>,
}

impl Sensor {
    /// A name that can be a column heading and a key of `[observations]`.
    pub(super) fn checked_name(name: &str) -> Result<&str, String> {
        let is_valid = name.chars().all(|c| c.is_ascii_alphanumeric() || "_-.".contains(c));
        let name = checked_name(name)?;
        if !is_valid || ["file", "sigma"].contains(&name) || name.ends_with("_sigma") {
            let expected =
                "expected letters, digits, `_`, `-` and `.`, such as \"TC1\", but not file, sigma or …_sigma";
            return Err(format!("invalid sensor name {name:?}: {expected}"));
        }
        Ok(name)
    }

    /// The side of a sensor, which must lie on an interface.
    pub(super) fn checked_side(side: Side, depth_m: f64, layup: &Layup) -> Result<Side, String> {
        // A held face in depth is the first marched face and may be an interface of the whole layup.
        let is_interface = layup.interfaces_m().contains(&depth_m) || (depth_m == layup.origin_m && depth_m > 0.0);
        if is_interface {
            return Ok(side);
        }
        Err(format!("a side needs a sensor on an interface of two plies: this one lies at {} mm", rounded_mm(depth_m)))
    }

    /// Record all errors of the fields; the depth is compared with a valid layup.
    pub(super) fn check(&self, at: &FieldPath<'_>, layup: Option<&Layup>) {
        at.child("name").require(Self::checked_name(&self.name));
        at.not_negative("time_constant_s", self.time_constant_s);
        if let Some(pyrometer) = &self.pyrometer {
            pyrometer.check(&at.child("pyrometer"));
            if self.depth_m != 0.0 || self.time_constant_s != 0.0 {
                at.error("expected a depth and a lag of 0 of a pyrometer, which looks at the hot face");
            }
        }
        let depth = at.child("depth_m");
        let depth_m = depth.require(not_negative(self.depth_m, self.depth_m));
        let Some((layup, depth_m)) = layup.zip(depth_m) else { return };
        if let Some(depth_m) = depth.require(layup.checked_depth_m(depth_m))
            && self.side != Side::Both
        {
            at.child("side").require(Self::checked_side(self.side, depth_m, layup));
        }
    }
}

/// The side of an interface on which a sensor lies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
#[derive(serde::Serialize)]
pub enum Side {
    /// The lower face of the ply above.
    Above,
    /// The upper face of the ply below.
    Below,
    /// The mean of the two faces.
    #[default]
    Both,
}
