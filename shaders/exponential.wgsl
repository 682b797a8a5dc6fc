// Exponential, logarithm and powers of our own: twin of src/physics/exponential.rs.

const LOG2_E = 1.4426950408889634;
const LN_2 = 0.6931471805599453;
const LN_2_HIGH = 0.693145751953125;
const LN_2_LOW = 1.4286068203094172e-6;
const LARGEST = 80.0;
// Of (eˣ − 1)/x; the first term is one.
const SERIES_1 = real(0.5000000000000006);
const SERIES_2 = real(0.16666666666666563);
const SERIES_3 = real(0.041666666666573905);
const SERIES_4 = real(0.008333333333397834);
const SERIES_5 = real(0.0013888888932258882);
const SERIES_6 = real(0.00019841269707467223);
const SERIES_7 = real(2.480150460214848e-5);
const SERIES_8 = real(2.7557414789965974e-6);
const SERIES_9 = real(2.762626278810536e-7);
const SERIES_10 = real(2.505209632569198e-8);
const SHORT_1 = real(0.4999999701976776);
const SHORT_2 = real(0.16666506230831146);
const SHORT_3 = real(0.041667137295007706);
const SHORT_4 = real(0.00836906861513853);
const SHORT_5 = real(0.0013888872927054763);

struct Power {
    two_to: real,
    part: real,
}

fn two_terms(term: real, next: real, rest: real) -> real {
    return term + keep(next * rest);
}

fn four_terms(term: real, second: real, third: real, fourth: real, rest: real, square: real) -> real {
    return two_terms(term, second, rest) + keep(two_terms(third, fourth, rest) * square);
}

fn power_of_e(x: real) -> Power {
    let bounded = min(max(x, real(-LARGEST)), real(LARGEST));
    let twos = nearest(bounded * real(LOG2_E));
    let rest = keep(bounded - twos * real(LN_2_HIGH)) - twos * real(LN_2_LOW);
    let square = keep(rest * rest);
    let fourth = keep(square * square);
    var sum: real;
    if DIGITS > 23u {
        let low = four_terms(1.0, SERIES_1, SERIES_2, SERIES_3, rest, square)
            + keep(four_terms(SERIES_4, SERIES_5, SERIES_6, SERIES_7, rest, square) * fourth);
        let high = two_terms(SERIES_8, SERIES_9, rest) + keep(SERIES_10 * square);
        sum = low + keep(high * keep(fourth * fourth));
    } else {
        sum = four_terms(1.0, SHORT_1, SHORT_2, SHORT_3, rest, square) + keep(two_terms(SHORT_4, SHORT_5, rest) * fourth);
    }
    return Power(two_to(twos), keep(sum * rest));
}

fn exponential(x: real) -> real {
    let power = power_of_e(x);
    return (power.part + 1.0) * power.two_to;
}

fn decay(x: real) -> real {
    let power = power_of_e(-x);
    return (1.0 - power.two_to) - power.two_to * power.part;
}

fn logarithm(x: real) -> real {
    let twos = twos_of(x);
    let mantissa = mantissa_of(x);
    let s = (mantissa - 1.0) / (mantissa + 1.0);
    let square = s * s;
    var sum = real(1.0 / 11.0);
    sum = keep(sum * square) + real(1.0 / 9.0);
    sum = keep(sum * square) + real(1.0 / 7.0);
    sum = keep(sum * square) + real(1.0 / 5.0);
    sum = keep(sum * square) + real(1.0 / 3.0);
    sum = keep(sum * square) + 1.0;
    let near = twos * real(LN_2) + keep((s + s) * sum);
    let back = exponential(near);
    return near + (x - back) * 2.0 / (x + back);
}

fn power(x: real, m: real) -> real {
    return exponential(m * logarithm(max(x, real(1e-30))));
}
