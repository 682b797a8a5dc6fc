//! `bondline predict`: the case at its nominal factors.

use crate::command::args::{CaseArgs, ProfileArgs, convert};
use crate::command::exit::{Failure, Output};
use crate::command::run::{Run, load};

pub(crate) fn run(args: &CaseArgs, profiles: &ProfileArgs) -> Result<Output, Failure> {
    let case = load(&args.case, &args.march)?;
    let profiles = convert::depth_profiles(profiles, &case)?;
    let mut run = Run::open("predict", args, case)?;
    run.session.set_depth_profiles(profiles)?;
    run.session.predict()?;
    run.finish(None)
}
