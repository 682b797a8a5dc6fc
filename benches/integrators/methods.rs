//! Time integrators, all linearly implicit: one tridiagonal matrix a step, factored once, without iteration.

use crate::layup::{Derivatives, Evaluation, Layup};
use bondline::plan::Plan;
use bondline_physics::Real;
use bondline_physics::layout::BoundaryForcing;
use bondline_physics::tridiagonal::{factorise, substitute};

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Method {
    /// The two-stage Rosenbrock method of src/physics/step.rs.
    Ros2,
    Rodas3,
    Rodas,
    /// Backward differentiation formula of second or third order.
    Bdf(usize),
}

impl Method {
    pub(crate) fn name(self) -> String {
        match self {
            Self::Ros2 => "pair".to_owned(),
            Self::Rodas3 => "RODAS3".to_owned(),
            Self::Rodas => "RODAS".to_owned(),
            Self::Bdf(order) => format!("BDF{order}"),
        }
    }
}

/// A Rosenbrock method, in the unknowns `Uᵢ` that need no product with the Jacobian (Hairer & Wanner 1996, IV.7.25),
/// multiplied by heat capacities:
///
/// ```text
/// (C/(γΔt) + F C'/C − K) Uᵢ = C/Cᵢ Fᵢ + C/Δt Σ cᵢⱼ Uⱼ + γᵢ r,    Fᵢ at T + Σ aᵢⱼ Uⱼ and t + αᵢ Δt
/// T' = T + Σ mⱼ Uⱼ
/// ```
struct Rosenbrock<const S: usize> {
    gamma: f64,
    a: [[f64; S]; S],
    c: [[f64; S]; S],
    m: [f64; S],
    alpha: [f64; S],
    gammas: [f64; S],
    /// Whether the matrix includes C'; a W-method keeps its order without it.
    is_exact: bool,
}

const GAMMA: f64 = 1.0 - std::f64::consts::FRAC_1_SQRT_2;

const ROS2: Rosenbrock<2> = Rosenbrock {
    gamma: GAMMA,
    a: [[0.0; 2], [1.0 / GAMMA, 0.0]],
    c: [[0.0; 2], [-2.0 / GAMMA, 0.0]],
    m: [1.5 / GAMMA, 0.5 / GAMMA],
    alpha: [0.0, 1.0],
    gammas: [GAMMA, -GAMMA],
    is_exact: false,
};

/// Third order, L-stable, stiffly accurate; the second stage has the arguments of the first (Sandu et al., Atmos.
/// Environ. 31, 1997).
const RODAS3: Rosenbrock<4> = Rosenbrock {
    gamma: 0.5,
    a: [[0.0; 4], [0.0; 4], [2.0, 0.0, 0.0, 0.0], [2.0, 0.0, 1.0, 0.0]],
    c: [[0.0; 4], [4.0, 0.0, 0.0, 0.0], [1.0, -1.0, 0.0, 0.0], [1.0, -1.0, -8.0 / 3.0, 0.0]],
    m: [2.0, 0.0, 1.0, 1.0],
    alpha: [0.0, 0.0, 1.0, 1.0],
    gammas: [0.5, 1.5, 0.0, 0.0],
    is_exact: true,
};

/// Fourth order, L-stable, stiffly accurate (Hairer & Wanner, Solving Ordinary Differential Equations II, 1996, RODAS).
const RODAS: Rosenbrock<6> = Rosenbrock {
    gamma: 0.25,
    a: [
        [0.0; 6],
        [1.544, 0.0, 0.0, 0.0, 0.0, 0.0],
        [0.946_678_528_081_582_6, 0.255_701_169_898_328_4, 0.0, 0.0, 0.0, 0.0],
        [3.314_825_187_068_521, 2.896_124_015_972_201, 0.998_641_913_997_781_7, 0.0, 0.0, 0.0],
        [1.221_224_509_226_641, 6.019_134_481_288_629, 12.537_083_329_320_87, -0.687_886_036_105_895, 0.0, 0.0],
        [1.221_224_509_226_641, 6.019_134_481_288_629, 12.537_083_329_320_87, -0.687_886_036_105_895, 1.0, 0.0],
    ],
    c: [
        [0.0; 6],
        [-5.6688, 0.0, 0.0, 0.0, 0.0, 0.0],
        [-2.430_093_356_833_875, -0.206_359_915_709_191_5, 0.0, 0.0, 0.0, 0.0],
        [-0.107_352_905_815_137_5, -9.594_562_251_023_355, -20.470_286_148_096_16, 0.0, 0.0, 0.0],
        [7.496_443_313_967_647, -10.246_804_314_643_52, -33.999_903_528_199_05, 11.708_908_932_061_6, 0.0, 0.0],
        [
            8.083_246_795_921_522,
            -7.981_132_988_064_893,
            -31.521_594_328_743_71,
            16.319_305_431_231_36,
            -6.058_818_238_834_054,
            0.0,
        ],
    ],
    m: [1.221_224_509_226_641, 6.019_134_481_288_629, 12.537_083_329_320_87, -0.687_886_036_105_895, 1.0, 1.0],
    alpha: [0.0, 0.386, 0.21, 0.63, 1.0, 1.0],
    gammas: [0.25, -0.1043, 0.1035, -0.0362, 0.0, 0.0],
    is_exact: true,
};

/// Maximum number of stages, and of earlier temperatures that a step uses.
const STAGES: usize = 6;
const MAX_BDF_ORDER: usize = 3;

/// The steps of a plan, and whether each starts at a corner of the schedule.
pub(crate) struct Steps<'a> {
    plan: &'a Plan,
    is_corner: Vec<bool>,
}

impl<'a> Steps<'a> {
    pub(crate) fn of(plan: &'a Plan) -> Self {
        let (drives, lengths_s) = (&plan.rows().data.boundary_forcing, &plan.rows().data.step_lengths_s);
        let slope = |step: usize| (drives[4 * step + 1].convection - drives[4 * step].convection) / lengths_s[step];
        let steepest = (0..plan.steps()).map(|step| slope(step).abs()).fold(0.0, f64::max);
        let bends = |step: usize| (slope(step) - slope(step - 1)).abs() > 1e-6 * steepest;
        Self { plan, is_corner: (0..plan.steps()).map(|step| step == 0 || bends(step)).collect() }
    }

    /// Boundary forcing at a share of a step.
    fn drive(&self, step: usize, share: f64) -> BoundaryForcing<f64> {
        let [start, end] = [0, 1].map(|end| self.plan.rows().data.boundary_forcing[4 * step + end]);
        // Only the flux changes in these cases.
        BoundaryForcing { convection: start.convection + share * (end.convection - start.convection), ..start }
    }
}

/// Integration of a member, or of one member a lane.
struct Integration<'a, R> {
    layup: &'a Layup<'a, R>,
    steps: &'a Steps<'a>,
    temperatures: Vec<R>,
    staged: Vec<R>,
    /// Temperatures at the ends of earlier steps, the latest first.
    earlier: [Vec<R>; MAX_BDF_ORDER],
    unknowns: [Vec<R>; STAGES],
    capacities: Vec<R>,
    at: Evaluation<R>,
    lower: Vec<R>,
    diagonal: Vec<R>,
    upper: Vec<R>,
}

/// March over all steps; `note` receives the temperatures at the start and after each step.
#[inline(always)]
pub(crate) fn march<R: Real<Scalar = f64, Constant = R>>(
    method: Method,
    layup: &Layup<'_, R>,
    steps: &Steps<'_>,
    mut note: impl FnMut(usize, &[R]),
) {
    let none = || vec![R::from_f64(0.0); layup.cells()];
    let mut way = Integration {
        layup,
        steps,
        temperatures: layup.start(),
        staged: none(),
        earlier: [(); MAX_BDF_ORDER].map(|()| none()),
        unknowns: [(); STAGES].map(|()| none()),
        capacities: none(),
        at: Evaluation::new(layup.cells()),
        lower: none(),
        diagonal: none(),
        upper: none(),
    };
    note(0, &way.temperatures);
    let mut since_corner = 0;
    for step in 0..steps.plan.steps() {
        if steps.is_corner[step] {
            since_corner = 0;
        }
        match method {
            Method::Ros2 => way.rosenbrock(&ROS2, step),
            Method::Rodas3 => way.rosenbrock(&RODAS3, step),
            Method::Rodas => way.rosenbrock(&RODAS, step),
            Method::Bdf(order) => {
                way.earlier.rotate_right(1);
                way.earlier[0].copy_from_slice(&way.temperatures);
                // No formula uses temperatures before a corner, where slopes jump.
                if since_corner + 1 < order { way.rosenbrock(&ROS2, step) } else { way.bdf(order, step) }
            }
        }
        since_corner += 1;
        note(step + 1, &way.temperatures);
    }
}

impl<R: Real<Scalar = f64, Constant = R>> Integration<'_, R> {
    #[inline(always)]
    fn rosenbrock<const S: usize>(&mut self, method: &Rosenbrock<S>, step: usize) {
        let per_length = 1.0 / self.steps.plan.rows().data.step_lengths_s[step];
        let slopes = if method.is_exact { Derivatives::All } else { Derivatives::Fluxes };
        self.layup.evaluate(&self.temperatures, self.steps.drive(step, 0.0), slopes, &mut self.at);
        self.capacities.copy_from_slice(&self.at.capacities);
        let own = R::from_f64(per_length / method.gamma);
        let cells = self.diagonal.len();
        let (diagonal, capacities) = (&mut self.diagonal[..], &self.capacities[..cells]);
        let (net, rises) = (&self.at.net[..cells], &self.at.capacity_slopes[..cells]);
        for i in 0..cells {
            diagonal[i] = capacities[i] * own;
            if method.is_exact {
                diagonal[i] = diagonal[i] + net[i] * rises[i] / capacities[i];
            }
        }
        self.factorise();
        let driven =
            self.layup.hot_face_flux(self.temperatures[0], self.steps.drive(step, 1.0), Derivatives::None).flux
                - self.at.hot.flux;
        for stage in 0..S {
            if method.a[stage] != [0.0; S] {
                combine(&mut self.staged, &self.temperatures, &self.unknowns[..stage], &method.a[stage]);
                let drive = self.steps.drive(step, method.alpha[stage]);
                self.layup.evaluate(&self.staged, drive, Derivatives::None, &mut self.at);
            }
            let (before, here) = self.unknowns.split_at_mut(stage);
            let side = &mut here[0][..];
            if stage == 0 {
                side.copy_from_slice(&self.at.net);
            } else {
                let weights = method.c[stage].map(|c| c * per_length);
                let none = R::from_f64(0.0);
                side.fill(none);
                add(side, before, &weights);
                let net = &self.at.net[..side.len()];
                let (now, start) = (&self.at.capacities[..side.len()], &self.capacities[..side.len()]);
                for i in 0..side.len() {
                    side[i] = start[i] * (net[i] / now[i] + side[i]);
                }
            }
            side[0] = side[0] + R::from_f64(method.gammas[stage]) * driven;
            substitute(&self.lower, &self.diagonal, &self.upper, side);
        }
        add(&mut self.temperatures, &self.unknowns[..S], &method.m);
    }

    /// A BDF step, linearly implicit: the polynomial through the step's end and earlier ends gives the time derivative,
    /// and one Newton iteration starts at the extrapolation of the earlier ends, whose error falls with twice its
    /// order.
    #[inline(always)]
    fn bdf(&mut self, order: usize, step: usize) {
        let time_s = |back: usize| self.steps.plan.times_s()[step + 1 - back];
        let (mut ahead, mut slope) = ([0.0; MAX_BDF_ORDER], [0.0; MAX_BDF_ORDER]);
        let mut own = 0.0;
        for j in 1..=order {
            let others = || (1..=order).filter(move |&other| other != j);
            let leads = others().map(|other| (time_s(0) - time_s(other)) / (time_s(j) - time_s(other)));
            ahead[j - 1] = leads.product();
            slope[j - 1] = ahead[j - 1] / (time_s(j) - time_s(0));
            own += 1.0 / (time_s(0) - time_s(j));
        }
        let earlier = &self.earlier[..order];
        self.staged.fill(R::from_f64(0.0));
        add(&mut self.staged, earlier, &ahead);
        self.layup.evaluate(&self.staged, self.steps.drive(step, 1.0), Derivatives::All, &mut self.at);
        let [side, rates, ..] = &mut self.unknowns;
        rates.fill(R::from_f64(0.0));
        add(rates, earlier, &slope);
        add(rates, std::slice::from_ref(&self.staged), &[own]);
        let (diagonal, cells, own) = (&mut self.diagonal[..], side.len(), R::from_f64(own));
        let (net, rates) = (&self.at.net[..cells], &rates[..cells]);
        let (capacities, rises) = (&self.at.capacities[..cells], &self.at.capacity_slopes[..cells]);
        for i in 0..cells {
            side[i] = net[i] - capacities[i] * rates[i];
            diagonal[i] = capacities[i] * own + rises[i] * rates[i];
        }
        self.factorise();
        substitute(&self.lower, &self.diagonal, &self.upper, &mut self.unknowns[0]);
        combine(&mut self.temperatures, &self.staged, &self.unknowns[..1], &[1.0]);
    }

    /// Add the derivatives of the net fluxes to the cell's own diagonal terms and factorise the matrix.
    #[inline(always)]
    fn factorise(&mut self) {
        let cells = self.diagonal.len();
        let (lower, upper) = (&mut self.lower[..cells], &mut self.upper[..cells]);
        let diagonal = &mut self.diagonal[..cells];
        // The back is insulated: the derivatives below the last cell are zero.
        let (leaving, coming) = (&self.at.by_upper[..cells], &self.at.by_lower[..cells]);
        let (mut arriving, mut returned) = (R::from_f64(0.0), -self.at.hot.slope);
        for i in 0..cells {
            diagonal[i] = diagonal[i] + (returned + leaving[i]);
            lower[i] = -arriving;
            upper[i] = -coming[i];
            (arriving, returned) = (leaving[i], coming[i]);
        }
        factorise(&mut self.lower, &mut self.diagonal, &mut self.upper);
    }
}

/// Base plus a weighted sum of columns.
#[inline(always)]
fn combine<R: Real>(sum: &mut [R], base: &[R], columns: &[Vec<R>], weights: &[f64]) {
    sum.copy_from_slice(base);
    add(sum, columns, weights);
}

/// Add a weighted sum of columns.
#[inline(always)]
fn add<R: Real>(sum: &mut [R], columns: &[Vec<R>], weights: &[f64]) {
    for (column, &weight) in columns.iter().zip(weights).filter(|(_, weight)| **weight != 0.0) {
        let (weight, column) = (R::from_f64(weight), &column[..sum.len()]);
        for i in 0..sum.len() {
            sum[i] = sum[i] + weight * column[i];
        }
    }
}
