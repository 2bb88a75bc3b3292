//! The network against the five layers written out, against published figures, and at its edges.

use greyrig::anfis::{
    Anfis, Correction, EXP2_ERROR, Firing, Kernel, LOG2_ERROR, Premise, Settings, Shape, consequent_parameters, nodes,
    premise_parameters, rules,
};
use proptest::prelude::*;

/// Jang's example 2 (three-input function, two bells an input): the parameters after 200 epochs of hybrid learning by
/// an independent program in Python.
const JANG_PREMISE: [[Premise; 2]; 3] = [
    [
        Premise { a: 3.097530909368612, b: 1.381420107879098, c: 1.1542972981801156 },
        Premise { a: 3.2389140348734506, b: 2.23530594632238, c: 5.165937149316228 },
    ],
    [
        Premise { a: 2.0935920064174494, b: 1.0511858817363195, c: 0.12012929602159825 },
        Premise { a: 3.1996152972661718, b: 2.570302254004297, c: 4.897413648559835 },
    ],
    [
        Premise { a: 1.8680016508576762, b: 1.069367012775041, c: -0.08385332030012564 },
        Premise { a: 3.1365898987912524, b: 2.6353827094065467, c: 4.866689182448984 },
    ],
];
const JANG_SLOPES: [[f64; 3]; 8] = [
    [4.9108294245609585, -6.041999634276385, -7.936975372410456],
    [3.4109292682216976, -3.966677479400074, -0.30476753892732894],
    [3.549565381857088, -0.35859706215556614, -5.400945362577638],
    [2.0744946997201694, -0.2235566779258474, -0.20178173347684203],
    [2.9091407284415265, -9.605071160879058, -12.741500105696142],
    [2.1771335002272076, -7.531149968217226, -0.4999988675029143],
    [2.2448192429275577, -0.5905154814898969, -10.206268771057116],
    [1.5246016021534436, -0.4556556817612141, -0.39709528235046027],
];
const JANG_CONSTANTS: [f64; 8] = [
    26.94823202430845,
    14.83422449612234,
    17.354649308014796,
    8.65452355253598,
    34.01909963436652,
    20.96514468419319,
    25.025071861804665,
    15.287496790021688,
];

/// Settings with the rest as it does not matter: a box of ±1 and a wide output.
fn settings<const N: usize, const M: usize, const R: usize>(
    premise: [[Premise; M]; N],
    slopes: [[f64; N]; R],
    constants: [f64; R],
) -> Settings<N, M, R> {
    Settings {
        shape: Shape::Bell,
        firing: Firing::Product,
        premise,
        slopes,
        constants,
        inputs: [(-1.0, 1.0); N],
        output: (-1e6, 1e6),
        margin: 0.1,
    }
}

fn jang() -> Settings<3, 2, 8> {
    Settings { inputs: [(1.0, 6.0); 3], output: (0.0, 100.0), ..settings(JANG_PREMISE, JANG_SLOPES, JANG_CONSTANTS) }
}

/// Average percentage error over a cubic grid, Jang's equation 29.
fn average_percentage_error<S: Kernel>(network: &Anfis<S, 3, 2, 8>, grid: impl Iterator<Item = f64> + Clone) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for x in grid.clone() {
        for y in grid.clone() {
            for z in grid.clone() {
                let target = (1.0 + x.sqrt() + 1.0 / y + z.powf(-1.5)).powi(2);
                let output = network.correct([x, y, z].map(S::constant)).value;
                // All Scalar types print their value.
                let output: f64 = format!("{output:?}").parse().expect("a number");
                sum += (target - output).abs() / target;
                count += 1.0;
            }
        }
    }
    100.0 * sum / count
}

/// The five layers as they stand in the paper, with the standard library's functions and the stated floor of the
/// memberships: the output f̄ = Σ w̄ f, and the spread Σ w̄ |f − f̄| of the rules about it.
fn five_layers<const N: usize, const M: usize, const R: usize>(s: &Settings<N, M, R>, x: [f64; N]) -> (f64, f64) {
    let rules: Vec<(f64, f64)> = (0..R)
        .map(|rule| {
            let mut strength: f64 = 1.0;
            let mut output = s.constants[rule];
            for (i, x) in x.iter().enumerate() {
                let j = rule / M.pow((N - 1 - i) as u32) % M;
                let Premise { a, b, c } = s.premise[i][j];
                let mu = match s.shape {
                    Shape::Bell => 1.0 / (1.0 + ((x - c) / a).abs().powf(2.0 * b).min(32f64.exp2())),
                    Shape::Gaussian => (-0.5 * ((x - c) / a).powi(2)).exp().max((-32f64).exp2()),
                };
                strength = match s.firing {
                    Firing::Product => strength * mu,
                    Firing::Minimum => strength.min(mu),
                };
                output += s.slopes[rule][i] * x;
            }
            (strength, output)
        })
        .collect();
    let total: f64 = rules.iter().map(|(strength, _)| strength).sum();
    let mean = |value: &dyn Fn(f64) -> f64| rules.iter().map(|(w, f)| w * value(*f)).sum::<f64>() / total;
    let output = mean(&|f| f);
    (output, mean(&|f| (f - output).abs()))
}

/// What single precision may add to or take from the output within the box of ±1.
///
/// Weights that are off by δ of themselves at most move their mean by δ Σ w̄ |f − f̄|. A membership is off by what the
/// kernel states for t, and by what z = (x − c)/a is off: at most six roundings of its largest value, 2b of which reach
/// a bell's t (z of which a Gaussian's exponent). A product sums that over its inputs. The rules themselves are sums of
/// differences of up to 2^N times the largest rule, four roundings each.
fn single_precision_bound<const N: usize, const M: usize, const R: usize>(s: &Settings<N, M, R>, spread: f64) -> f64 {
    let rounding = 2f64.powi(-24);
    let membership = |Premise { a, b, c }: &Premise| {
        let farthest = (c.abs() + 1.0) / a;
        let z = 6.0 * rounding * farthest;
        let (sensitivity, power) = match s.shape {
            Shape::Bell => (2.0 * b, b * LOG2_ERROR + rounding * (2.0 * 32.0 + b)),
            Shape::Gaussian => (farthest, 3.0 * rounding * 32.0),
        };
        sensitivity * z + std::f64::consts::LN_2 * power + EXP2_ERROR + (2 * M + 3) as f64 * rounding
    };
    let inputs = s.premise.iter().map(|functions| functions.iter().map(membership).fold(0.0, f64::max));
    let weight = match s.firing {
        Firing::Product => inputs.sum(),
        Firing::Minimum => inputs.fold(0.0, f64::max) + 2.0 * R as f64 * rounding,
    };
    let largest = (0..R)
        .map(|rule| s.constants[rule].abs() + s.slopes[rule].iter().map(|p| p.abs()).sum::<f64>())
        .fold(0.0, f64::max);
    weight * spread + 4.0 * (N as f64 + 1.0).exp2() * largest * rounding
}

#[test]
fn counts_are_those_of_the_paper() {
    // Rakar and Juričić 2004: three inputs, three functions each. Jang 1993: examples 1, 2 and 4.
    assert_eq!((rules(3, 3), premise_parameters(3, 3), consequent_parameters(3, 3), nodes(3, 3)), (27, 27, 108, 91));
    assert_eq!(premise_parameters(2, 4) + consequent_parameters(2, 4), 72);
    assert_eq!(premise_parameters(3, 2) + consequent_parameters(3, 2), 50);
    assert_eq!(premise_parameters(4, 2) + consequent_parameters(4, 2), 104);
}

#[test]
fn reproduces_jangs_three_input_function() {
    let training = (1..=6).map(f64::from);
    let checking = (1..=5).map(|k| f64::from(k) + 0.5);
    let double = jang().build::<f64>().unwrap();
    let single = jang().build::<f32>().unwrap();
    // Jang 1993, table III: 0.043 % and 1.066 %; the independent program: 0.04329 and 1.06582.
    assert!((average_percentage_error(&double, training.clone()) - 0.04329).abs() < 5e-6);
    assert!((average_percentage_error(&double, checking.clone()) - 1.06582).abs() < 5e-6);
    // Single precision and the polynomials move the outputs, 4 to 30, by some 1e-5.
    assert!((average_percentage_error(&single, training) - 0.043).abs() < 5e-4);
    assert!((average_percentage_error(&single, checking) - 1.066).abs() < 5e-4);
}

#[test]
fn polynomials_keep_their_bounds() {
    // Every 97th of all positive normal numbers; their logarithm is rounded to 2^-24 of itself.
    for bits in (0x0080_0000..0x7f80_0000_u32).step_by(97) {
        let v = f32::from_bits(bits);
        let exact = f64::from(v).log2() - 0.5;
        let error = f64::from(Kernel::log2_over_root_two(v)) - exact;
        assert!(error.abs() <= LOG2_ERROR + exact.abs() * 2f64.powi(-24), "log2 {v:e}: {error:e}");
    }
    let unit = f64::from(f32::UNIT as f32);
    for step in 0..2_000_000 {
        let p = (f64::from(step) / 31_250.0 - 32.0) as f32;
        let scaled = p * f32::EXPONENT as f32;
        // What was asked for: the argument is a whole number of 2^-23.
        let exact = (f64::from(scaled).trunc() / f32::EXPONENT).exp2();
        let error = f64::from(Kernel::scaled_exp2(scaled)) / (unit * exact) - 1.0;
        assert!(error.abs() <= EXP2_ERROR, "exp2 {p}: {error:e}");
    }
    assert_eq!((f64::from(Kernel::scaled_exp2(f32::INFINITY)) / unit).log2().round(), 32.0);
    assert_eq!((f64::from(Kernel::scaled_exp2(f32::NEG_INFINITY)) / unit).log2().round(), -32.0);
}

/// With consequents 0 and 1 the output is μ2/(μ1 + μ2); with the first function so wide that μ1 is 1 within 1e-7, μ2
/// follows.
#[test]
fn membership_keeps_its_bound() {
    for b in [0.5, 1.0, 1.3, 2.0, 3.7, 5.0] {
        for a in [0.05, 0.3, 1.0] {
            let premise = [[Premise { a: 1e4, b: 2.0, c: 0.0 }, Premise { a, b, c: 0.1 }]];
            let network = settings::<1, 2, 2>(premise, [[0.0], [0.0]], [0.0, 1.0]).build::<f32>().unwrap();
            for step in -20_000..=20_000 {
                let x = f64::from(step) / 20_000.0;
                let t = ((x - 0.1) / a).abs().powf(2.0 * b);
                let exact = 1.0 / (2.0 + t);
                let output = f64::from(network.correct([x as f32]).value);
                // |Δt/t| as the kernel states it; the share changes by at most a quarter of that. Rounding besides, of
                // which x itself is part: 2^-24 of the box, times the slope of μ, b/(2a) at most.
                let log = t.max(1e-300).log2().abs().min(32.0);
                let power = std::f64::consts::LN_2 * (b * LOG2_ERROR + 3.0 * 2f64.powi(-24) * log) + EXP2_ERROR;
                let bound = power / 4.0 + 2f64.powi(-24) * (4.0 + b / a);
                assert!((output - exact).abs() <= bound, "b {b} a {a} x {x}: {:e} > {bound:e}", output - exact);
            }
        }
    }
}

fn point<const N: usize>() -> impl Strategy<Value = [f64; N]> {
    prop::collection::vec(-1.0..1.0, N).prop_map(|x| std::array::from_fn(|i| x[i]))
}

fn premise(shape: Shape) -> impl Strategy<Value = Premise> {
    let narrowest = if shape == Shape::Gaussian { 0.4 } else { 0.15 };
    (narrowest..2.0, 0.5..5.0, -1.5..1.5).prop_map(|(a, b, c)| Premise { a, b, c })
}

fn any_settings<const N: usize, const M: usize, const R: usize>() -> impl Strategy<Value = Settings<N, M, R>> {
    let shapes = prop_oneof![Just(Shape::Bell), Just(Shape::Gaussian)];
    let firing = prop_oneof![Just(Firing::Product), Just(Firing::Minimum)];
    let exponent = prop_oneof![Just(None), Just(Some(1.0)), Just(Some(2.0))];
    (shapes, firing, exponent).prop_flat_map(|(shape, firing, exponent)| {
        let premises = prop::collection::vec(premise(shape), N * M);
        let consequents = prop::collection::vec(-3.0..3.0, R * (N + 1));
        (premises, consequents).prop_map(move |(premises, consequents)| {
            let premise = std::array::from_fn(|i| {
                std::array::from_fn(|j| {
                    let p = premises[i * M + j];
                    Premise { b: exponent.unwrap_or(p.b), ..p }
                })
            });
            let slopes = std::array::from_fn(|r| std::array::from_fn(|i| consequents[r * (N + 1) + i]));
            let constants = std::array::from_fn(|r| consequents[r * (N + 1) + N]);
            Settings { shape, firing, ..settings(premise, slopes, constants) }
        })
    })
}

/// In the box, `f64` follows the layers to rounding and `f32` to what its kernel allows.
fn follows_the_layers<const N: usize, const M: usize, const R: usize>(
    settings: &Settings<N, M, R>,
    point: [f64; N],
) -> Result<(), TestCaseError> {
    let (expected, spread) = five_layers(settings, point);
    let double = settings.build::<f64>().unwrap().correct(point);
    // |x − c|^(2b) counts as 2^-32 at least: as much of each of the memberships, of four inputs at most.
    prop_assert!(
        (double.value - expected).abs() <= 4.0 * (-32f64).exp2() * spread + 1e-12,
        "{} {expected}",
        double.value
    );
    let single = settings.build::<f32>().unwrap().correct(point.map(|x| x as f32));
    let bound = single_precision_bound(settings, spread);
    prop_assert!((f64::from(single.value) - expected).abs() <= bound, "{} {expected} {bound:e}", single.value);
    prop_assert_eq!((double.validity, single.validity), (1.0, 1.0));
    Ok(())
}

proptest! {
    #[test]
    fn follows_the_layers_on_three_by_three(s in any_settings::<3, 3, 27>(), x in point::<3>()) {
        follows_the_layers(&s, x)?;
    }

    #[test]
    fn follows_the_layers_on_other_grids(
        one in any_settings::<1, 4, 4>(), two in any_settings::<2, 6, 36>(), four in any_settings::<4, 2, 16>(),
        x in point::<4>(),
    ) {
        follows_the_layers(&one, [x[0]])?;
        follows_the_layers(&two, [x[0], x[1]])?;
        follows_the_layers(&four, x)?;
    }

    /// The normalised firing strengths add to one, wherever the inputs are.
    #[test]
    fn equal_consequents_give_themselves(s in any_settings::<3, 3, 27>(), x in point::<3>(), k in -9.0..9.0) {
        let s = Settings { slopes: [[0.0; 3]; 27], constants: [k; 27], ..s };
        let value = s.build::<f32>().unwrap().correct(x.map(|x| x as f32)).value;
        // With the minimum 27 products over 27 strengths: 56 roundings of a number below 9.
        prop_assert!((f64::from(value) - k).abs() < 56.0 * 9.0 * 2f64.powi(-24), "{value} {k}");
    }

    /// Whatever comes in, what goes out is finite and in range, and flagged unless all inputs are near the box.
    #[test]
    fn any_bits_are_answered(s in any_settings::<3, 3, 27>(), bits in any::<[u32; 3]>()) {
        let s = Settings { output: (-0.5, 0.25), ..s };
        let x = bits.map(f32::from_bits);
        let Correction { value, validity } = s.build::<f32>().unwrap().correct(x);
        prop_assert!((-0.5..=0.25).contains(&value) && (0.0..=1.0).contains(&validity));
        // The margin is a tenth of the box's width, 2.
        if !x.iter().all(|x| x.abs() < 1.2) {
            prop_assert_eq!((value, validity), (0.0, 0.0));
        }
        if x.iter().all(|x| x.abs() <= 1.0) {
            prop_assert_eq!(validity, 1.0);
        }
    }

    /// On a straight way out through a face, an edge or a corner nothing jumps, validity only falls, and the value is
    /// that at the edge times the validity.
    #[test]
    fn fades_smoothly(s in any_settings::<3, 3, 27>(), x in point::<3>(), way in point::<3>()) {
        let network = s.build::<f64>().unwrap();
        let mut last: Option<Correction<f64>> = None;
        for step in 0..=2_000 {
            let far = 3.0 * f64::from(step) / 2_000.0;
            let point = [0, 1, 2].map(|i| x[i] + far * way[i]);
            let now = network.correct(point);
            let edge = network.correct(point.map(|x| x.clamp(-1.0, 1.0)));
            // u is rounded to 2^-53 of the box.
            prop_assert!((now.value - edge.value * now.validity).abs() < 1e-9);
            let distance = point.iter().map(|x| (x.abs() - 1.0).max(0.0).powi(2)).sum::<f64>().sqrt() / 0.2;
            let expected = (1.0 - distance * distance).max(0.0).powi(2);
            prop_assert!((now.validity - expected).abs() < 1e-9);
            if let Some(last) = last {
                // The steepest slope of (1 − ρ²)² is 1.54, the step at most 0.0026 of 0.2.
                prop_assert!(now.validity <= last.validity + 1e-12 && last.validity - now.validity < 0.021);
            }
            last = Some(now);
        }
        prop_assert_eq!(network.correct([1.2001, 0.0, 0.0]), Correction { value: 0.0, validity: 0.0 });
    }
}

#[test]
fn a_nan_is_flagged_in_every_place() {
    let single = jang().build::<f32>().unwrap();
    let double = jang().build::<f64>().unwrap();
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for place in 0..3 {
            let mut point = [3.0; 3];
            point[place] = bad;
            assert_eq!(double.correct(point), Correction { value: 0.0, validity: 0.0 });
            assert_eq!(single.correct(point.map(|x| x as f32)), Correction { value: 0.0, validity: 0.0 });
        }
    }
}

#[test]
fn a_box_far_from_zero_loses_no_digits() {
    // A temperature in kelvin that varies by half a degree.
    let shifted = |offset: f64| {
        let premise = [[-0.25, 0.25].map(|c| Premise { a: 0.25, b: 1.7, c: offset + c })];
        let constants = [-offset, offset].map(|o| 1.0 + o);
        Settings { inputs: [(offset - 0.25, offset + 0.25)], ..settings(premise, [[1.0], [-1.0]], constants) }
    };
    let (far, near) = (shifted(300.0).build::<f32>().unwrap(), shifted(0.0).build::<f32>().unwrap());
    for step in -64..=64_i8 {
        // Steps of 2^-8, exact in both places.
        let x = f32::from(step) / 256.0;
        let (far, near) = (far.correct([300.0 + x]), near.correct([x]));
        // The shares and 1 ± x are the same numbers up to rounding.
        assert!((far.value - near.value).abs() < 1e-6, "{far:?} {near:?}");
        assert_eq!(far.validity, 1.0);
    }
}

#[test]
fn settings_that_make_no_network_are_refused() {
    let good = settings::<1, 2, 2>([[Premise { a: 1.0, b: 2.0, c: 0.0 }; 2]], [[0.0]; 2], [0.0; 2]);
    assert!(good.build::<f32>().is_ok());
    let spoilt = |name: &str, spoil: fn(&mut Settings<1, 2, 2>)| {
        let mut s = good;
        spoil(&mut s);
        assert_eq!(s.build::<f32>().unwrap_err().name, name);
        assert_eq!(s.build::<f64>().unwrap_err().name, name);
    };
    spoilt("a", |s| s.premise[0][1].a = 0.0);
    spoilt("a", |s| s.premise[0][1].a = f64::NAN);
    spoilt("a", |s| s.premise[0][1].a = 1e-3);
    spoilt("b", |s| s.premise[0][1].b = -1.0);
    spoilt("b", |s| s.premise[0][1].b = 17.0);
    spoilt("c", |s| s.premise[0][1].c = f64::INFINITY);
    spoilt("slopes", |s| s.slopes[1][0] = f64::NAN);
    spoilt("constants", |s| s.constants[1] = f64::INFINITY);
    spoilt("inputs", |s| s.inputs[0] = (1.0, 1.0));
    spoilt("output", |s| s.output = (1.0, -1.0));
    spoilt("margin", |s| s.margin = 0.0);
}
