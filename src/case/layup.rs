//! The layup: plies from hot face to back face, and the sensors between and within them.

use super::check::{Field, Names, not_negative, positive};
use super::material::Material;
use std::sync::Arc;

/// Depths closer than this are one: a micrometre is less than any ply is known to.
pub(super) const SAME_DEPTH_M: f64 = 1e-6;

/// Millimetres to a tenth of a micrometre, for messages.
pub(super) fn mm(depth_m: f64) -> f64 {
    (depth_m * 1e7).round() / 1e4
}

/// A layer of one material.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Ply {
    /// A name that no other ply of the layup has: `INS1`.
    pub name: String,
    /// The plies that share scale factors: `OF`, `INS`, `GB` in the paper.
    pub group: String,
    /// What it is made of.
    pub material: Arc<Material>,
    /// Above zero, m.
    pub thickness_m: f64,
}

impl Ply {
    /// Whether it belongs to a group: the plies that name it, or the one ply of that name.
    pub(super) fn is_in(&self, group: &str) -> bool {
        self.group == group || self.name == group
    }

    /// Whether it decomposes, and makes gas by that.
    pub(super) fn makes_gas(&self) -> bool {
        self.material.decomposition.is_some()
    }

    fn check(&self, at: &Field<'_>) {
        at.not_blank("name", &self.name);
        at.not_blank("group", &self.group);
        at.positive("thickness_m", self.thickness_m);
        self.material.check(&at.field("material"));
    }
}

/// Plies from hot face to back face.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Layup {
    /// From the hot face to the back face, one at least.
    pub plies: Vec<Ply>,
    /// Contact conductance of each interface, one fewer than plies, W/m²/K; `None` is perfect contact.
    pub contacts_w_m2_k: Vec<Option<f64>>,
    /// Depth of the first marched face below the hot face: above zero where a thermocouple drives the
    /// march and the layup above it has dropped out. Ply thicknesses are what is left of them.
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

    /// The depth of the face that a depth all but meets, else the depth itself, m.
    pub(super) fn on_face_m(&self, depth_m: f64) -> f64 {
        let faces_m = self.faces_m();
        let near = |face_m: &&f64| (**face_m - depth_m).abs() <= SAME_DEPTH_M;
        if faces_m.contains(&depth_m) { depth_m } else { faces_m.iter().find(near).copied().unwrap_or(depth_m) }
    }

    /// A depth on the layup, moved onto a face that it all but meets, m.
    pub(super) fn depth_m(&self, depth_m: f64) -> Result<f64, String> {
        let (top_m, back_m) = (self.origin_m, self.back_m());
        if depth_m < top_m {
            return Err(format!("{} mm is off the layup, whose first face lies at {} mm", mm(depth_m), mm(top_m)));
        }
        if depth_m > back_m + SAME_DEPTH_M {
            return Err(format!("{} mm is off the layup, whose back face lies at {} mm", mm(depth_m), mm(back_m)));
        }
        Ok(self.on_face_m(depth_m))
    }

    /// What is left of the layup below a depth, above its back face.
    pub(super) fn below(self, depth_m: f64) -> Self {
        let faces_m = self.faces_m();
        let gone = faces_m.iter().filter(|&&face_m| face_m <= depth_m).count();
        let top_m = if gone == 0 { 0.0 } else { faces_m[gone - 1] };
        let mut plies = self.plies;
        plies.drain(..gone);
        // A ply that the depth only touches keeps its thickness to the last bit.
        if depth_m > top_m {
            plies[0].thickness_m = faces_m[gone] - depth_m;
        }
        let contacts_w_m2_k = self.contacts_w_m2_k[gone..].to_vec();
        Self { plies, contacts_w_m2_k, origin_m: depth_m }
    }

    /// Record what is wrong with each field. Returns whether depths can be told from it.
    pub(super) fn check(&self, at: &Field<'_>) -> bool {
        let mut names = Names::of("ply");
        for (at, ply) in at.field("plies").items(&self.plies) {
            ply.check(&at);
            at.field("name").require(names.add(&ply.name));
        }
        let contacts = at.field("contacts_w_m2_k");
        contacts.require_each(&self.contacts_w_m2_k, |contact| {
            contact.map(|contact_w_m2_k| positive(contact_w_m2_k, contact_w_m2_k)).transpose()
        });
        let (wanted, found) = (self.plies.len().saturating_sub(1), self.contacts_w_m2_k.len());
        if found != wanted {
            contacts.fault(format!("{found} contacts: expected one for each of {wanted} interfaces"));
        }
        at.not_negative("origin_m", self.origin_m);
        if self.plies.is_empty() {
            at.field("plies").fault("no ply: expected at least one");
        }
        !self.plies.is_empty() && self.back_m().is_finite() && found == wanted
    }
}

/// A named depth where temperature is read.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub struct Sensor {
    /// A name that no other sensor has. It heads columns of tables: letters, digits, `_`, `-` and `.`.
    pub name: String,
    /// Depth below the hot face, m. A depth within a micrometre of an interface is moved onto it, where `side` says which
    /// of the two faces in contact the bead reads.
    pub depth_m: f64,
    /// Of no matter but on an interface.
    pub side: Side,
    /// First-order lag of the bead behind the layup, s; zero follows at once.
    pub lag_s: f64,
}

impl Sensor {
    /// A name that can head a column of a CSV and be a key of `[observations]`.
    pub(super) fn checked_name(name: &str) -> Result<&str, String> {
        let fit = name.chars().all(|c| c.is_ascii_alphanumeric() || "_-.".contains(c));
        if name.is_empty() || !fit || ["file", "sigma"].contains(&name) || name.ends_with("_sigma") {
            let expected = "expected letters, digits, `_`, `-` and `.`, such as \"TC1\"";
            return Err(format!("{name:?} cannot name a sensor: {expected}"));
        }
        Ok(name)
    }

    /// The side of a sensor on an interface of a layup.
    pub(super) fn checked_side(side: Side, depth_m: f64, layup: &Layup) -> Result<Side, String> {
        // The first marched face was an interface where a ply above it has dropped out.
        let is_interface = layup.interfaces_m().contains(&depth_m) || (depth_m == layup.origin_m && depth_m > 0.0);
        if is_interface { Ok(side) } else { Err("this sensor lies on no interface, which alone has sides".to_owned()) }
    }

    /// Record what is wrong with each field; depths are compared with those of a layup that has any.
    pub(super) fn check(&self, at: &Field<'_>, layup: Option<&Layup>) {
        at.field("name").require(Self::checked_name(&self.name));
        at.not_negative("lag_s", self.lag_s);
        let depth = at.field("depth_m");
        let depth_m = depth.require(not_negative(self.depth_m, self.depth_m));
        let Some((layup, depth_m)) = layup.zip(depth_m) else { return };
        if let Some(depth_m) = depth.require(layup.depth_m(depth_m))
            && self.side != Side::Both
        {
            at.field("side").require(Self::checked_side(self.side, depth_m, layup));
        }
    }
}

/// The side of an interface that a bead touches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
#[cfg_attr(feature = "serde", derive(serde::Serialize))]
pub enum Side {
    /// The lower face of the ply above.
    Above,
    /// The upper face of the ply below.
    Below,
    /// The mean of the two faces.
    #[default]
    Both,
}
