// How far a reaction goes in a step: twin of src/physics/decomposition.rs.

fn arrhenius_rate(reaction: Reaction, temperature_k: real, pre_exponential: real, steepness: real) -> real {
    let log_rate = min(reaction.log_rate_1_s - steepness, real(LOG_RATE_MAX));
    let constant = pre_exponential * exponential(log_rate);
    if reaction.onset_k == 0.0 {
        return constant;
    }
    return constant * ge_mask(temperature_k, reaction.onset_k);
}

fn mean_decay(x: real) -> real {
    let near = min(x, 0.5);
    var series = real(1.0);
    series = 1.0 - near * real(1.0 / 13.0) * series;
    series = 1.0 - near * real(1.0 / 12.0) * series;
    series = 1.0 - near * real(1.0 / 11.0) * series;
    series = 1.0 - near * real(1.0 / 10.0) * series;
    series = 1.0 - near * real(1.0 / 9.0) * series;
    series = 1.0 - near * real(1.0 / 8.0) * series;
    series = 1.0 - near * real(1.0 / 7.0) * series;
    series = 1.0 - near * real(1.0 / 6.0) * series;
    series = 1.0 - near * real(1.0 / 5.0) * series;
    series = 1.0 - near * real(1.0 / 4.0) * series;
    series = 1.0 - near * real(1.0 / 3.0) * series;
    series = 1.0 - near * real(1.0 / 2.0) * series;
    let far = max(x, 0.25);
    let large = (1.0 - exponential(-far)) / far;
    let is_large = ge_mask(x, 0.5);
    return series + is_large * opaque(large - series);
}

fn logarithm_1p(x: real) -> real {
    let near = min(max(x, -0.5), 0.5);
    let small = near * (1.0 - near * (0.5 - near * real(1.0 / 3.0)));
    let large = logarithm(max(1.0 + x, real(1e-30)));
    let is_large = ge_mask(near * near, real(1e-6));
    return small + is_large * opaque(large - small);
}

fn consumed_share(reactant: real, exposure: real, order: real) -> real {
    if order == 1.0 {
        return decay(exposure);
    }
    if order == 2.0 {
        let gone = exposure * reactant;
        return gone / (1.0 + gone);
    }
    if order == 3.0 {
        let gone = 2.0 * exposure * reactant * reactant;
        let root = sqrt(1.0 + gone);
        return gone / (root * (root + 1.0));
    }
    let above = order - 1.0;
    let gone = above * min(exposure, real(EXPOSURE_MAX)) * power(reactant, above);
    let decay = logarithm_1p(gone) / above;
    return decay * mean_decay(decay);
}
