//! The layup: plies from hot face to back face, and the sensors between and within them.

use super::material::Material;
use std::sync::Arc;

/// A layer of one material.
#[derive(Clone, Debug)]
pub struct Ply {
    pub name: String,
    /// The plies that share scale factors: `OF`, `INS`, `GB` in the paper.
    pub group: String,
    pub material: Arc<Material>,
    pub thickness_m: f64,
}

/// Plies from hot face to back face.
#[derive(Clone, Debug)]
pub struct Layup {
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
}

/// A named depth where temperature is read.
#[derive(Clone, Debug)]
pub struct Sensor {
    pub name: String,
    /// Depth below the hot face, m. On an interface it equals the depth of that interface exactly, and
    /// `side` says which of the two faces in contact the
    /// bead reads.
    pub depth_m: f64,
    /// Of no matter but on an interface.
    pub side: Side,
    /// First-order lag of the bead behind the layup, s; zero follows at once.
    pub lag_s: f64,
}

/// The side of an interface that a bead touches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Side {
    Above,
    Below,
    /// The mean of the two faces.
    #[default]
    Both,
}
