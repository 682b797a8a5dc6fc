// Exponential, logarithm and powers of our own: twin of src/physics/exponential.rs.

struct ExpParts {
    power_of_two: real,
    reduced_expm1: real,
}

fn two_terms(term: real, next: real, rest: real) -> real {
    return term + opaque(next * rest);
}

fn four_terms(term: real, second: real, third: real, fourth: real, rest: real, square: real) -> real {
    return two_terms(term, second, rest) + opaque(two_terms(third, fourth, rest) * square);
}

fn exp_parts(x: real) -> ExpParts {
    let bounded = min(max(x, real(-EXP_ARGUMENT_MAX)), real(EXP_ARGUMENT_MAX));
    let exponent = round_ties_even(bounded * real(LOG2_E));
    let rest = opaque(bounded - exponent * real(LN_2_HIGH)) - exponent * real(LN_2_LOW);
    let square = opaque(rest * rest);
    let fourth = opaque(square * square);
    var sum: real;
    if MANTISSA_BITS > 23u {
        let low = four_terms(SERIES_F64_0, SERIES_F64_1, SERIES_F64_2, SERIES_F64_3, rest, square)
            + opaque(four_terms(SERIES_F64_4, SERIES_F64_5, SERIES_F64_6, SERIES_F64_7, rest, square) * fourth);
        let high = two_terms(SERIES_F64_8, SERIES_F64_9, rest) + opaque(SERIES_F64_10 * square);
        sum = low + opaque(high * opaque(fourth * fourth));
    } else {
        sum = four_terms(SERIES_F32_0, SERIES_F32_1, SERIES_F32_2, SERIES_F32_3, rest, square)
            + opaque(two_terms(SERIES_F32_4, SERIES_F32_5, rest) * fourth);
    }
    return ExpParts(power_of_two(exponent), opaque(sum * rest));
}

fn exponential(x: real) -> real {
    let parts = exp_parts(x);
    return (parts.reduced_expm1 + 1.0) * parts.power_of_two;
}

fn decay(x: real) -> real {
    let parts = exp_parts(-x);
    return (1.0 - parts.power_of_two) - parts.power_of_two * parts.reduced_expm1;
}

fn logarithm(x: real) -> real {
    let exponent = exponent_of(x);
    let mantissa = mantissa_of(x);
    let s = (mantissa - 1.0) / (mantissa + 1.0);
    let square = s * s;
    var sum = real(1.0 / 11.0);
    sum = opaque(sum * square) + real(1.0 / 9.0);
    sum = opaque(sum * square) + real(1.0 / 7.0);
    sum = opaque(sum * square) + real(1.0 / 5.0);
    sum = opaque(sum * square) + real(1.0 / 3.0);
    sum = opaque(sum * square) + 1.0;
    let near = exponent * real(LN_2) + opaque((s + s) * sum);
    let back = exponential(near);
    return near + (x - back) * 2.0 / (x + back);
}

fn power(x: real, m: real) -> real {
    return exponential(m * logarithm(max(x, real(1e-30))));
}
