use super::*;
use crate::numeric::rng::Rng;
use crate::progress::Silent;
use crate::volume::Data;
use crate::volume::bits::BitGrid;
use proptest::prelude::*;

fn volume(dims: [usize; 3], data: Data) -> Volume {
    Volume {
        frame: Frame::straight(dims, [0.0; 3], [1.0, 2.0, 0.5]),
        data,
    }
}

fn grid(dims: [usize; 3], set: impl Fn(usize) -> bool) -> BitGrid {
    let mut grid = BitGrid::new(dims);
    for at in (0..dims.iter().product()).filter(|at| set(*at)) {
        let [x, y, z] = place(at, dims).map(|i| i as usize);
        grid.set(x, y, z);
    }
    grid
}

fn of(a: &Volume, b: &Volume) -> VolumeDifference {
    compare(a, b, &Params::DEFAULT, &Silent).expect("comparable volumes")
}

#[test]
fn bits_are_counted_by_label() {
    let dims = [70, 3, 5];
    let a = volume(dims, Data::Bits(grid(dims, |at| at < 100)));
    let b = volume(dims, Data::Bits(grid(dims, |at| (90..130).contains(&at))));
    let d = of(&a, &b);
    assert_eq!(
        (d.differing, d.voxels, d.first),
        (120, 1050, Some([0, 0, 0]))
    );
    let labels = d.labels.clone().expect("bits have labels");
    assert_eq!(labels[0], LabelOverlap::new(0, [950, 1010, 920]));
    assert_eq!(labels[1], LabelOverlap::new(1, [100, 40, 10]));
    assert_eq!((labels[1].only_a, labels[1].only_b), (90, 30));
    assert_eq!(
        (labels[1].dice, labels[1].jaccard),
        (20.0 / 140.0, 10.0 / 130.0)
    );
    assert_eq!(
        (d.amounts, d.identical, d.share),
        (None, false, 120.0 / 1050.0)
    );
    assert_eq!(d.accuracy().reached, Some(120.0));
    let same = of(&a, &a);
    assert!(same.identical && same.differing == 0 && same.first.is_none());
    assert_eq!(same.labels.expect("bits")[1].dice, 1.0);
}

#[test]
fn the_first_difference_is_named() {
    let dims = [130, 7, 9];
    let at = (4 * 7 + 5) * 130 + 129;
    let a = volume(dims, Data::Bits(grid(dims, |_| false)));
    let b = volume(dims, Data::Bits(grid(dims, |i| i >= at)));
    assert_eq!(of(&a, &b).first, Some([129, 5, 4]));
    let numbers =
        |from: usize| Data::U16((0..130 * 7 * 9).map(|i| 7 * u16::from(i >= from)).collect());
    let d = of(&volume(dims, numbers(at)), &volume(dims, numbers(at + 3)));
    assert_eq!((d.first, d.differing), (Some([129, 5, 4]), 3));
    assert_eq!(d.amounts.expect("numbers").max_at, Some([129, 5, 4]));
}

#[test]
fn labels_are_sorted_and_amounts_measured() {
    let dims = [4, 1, 1];
    let a = volume(dims, Data::I16(vec![-3, 0, 500, 500]));
    let b = volume(dims, Data::F32(vec![-3.0, 500.0, 500.0, 4.0]));
    let d = of(&a, &b);
    let labels: Vec<(i128, [u64; 3])> = d
        .labels
        .expect("whole numbers")
        .iter()
        .map(|l| (l.label, [l.a, l.b, l.both]))
        .collect();
    assert_eq!(
        labels,
        [
            (-3, [1, 1, 1]),
            (0, [1, 0, 0]),
            (4, [0, 1, 0]),
            (500, [2, 2, 1])
        ]
    );
    let amounts = d.amounts.expect("numbers");
    assert_eq!((amounts.max, amounts.max_at), (500.0, Some([1, 0, 0])));
    assert_eq!((amounts.mean, amounts.undefined), (996.0 / 4.0, 0));
    assert!((amounts.rms - ((500f64.powi(2) + 496f64.powi(2)) / 4.0).sqrt()).abs() < 1e-12);
}

#[test]
fn fractions_and_too_many_labels_are_amounts() {
    let dims = [2, 1, 1];
    let d = of(
        &volume(dims, Data::F64(vec![0.5, 1.0])),
        &volume(dims, Data::F64(vec![0.25, 1.0])),
    );
    assert_eq!((d.labels, d.differing), (None, 1));
    let dims = [300, 300, 1];
    let a = volume(dims, Data::F32((0..90_000).map(|i| i as f32).collect()));
    assert_eq!(of(&a, &a).labels, None);
    let few = volume(
        dims,
        Data::F32((0..90_000).map(|i| (i % 1000) as f32).collect()),
    );
    assert_eq!(of(&few, &few).labels.map(|l| l.len()), Some(1000));
    let d = compare(&few, &few, &Params { labels: 999 }, &Silent).expect("comparable");
    assert_eq!(d.labels, None);
}

#[test]
fn whole_numbers_of_64_bits_are_told_apart() {
    let dims = [3, 1, 1];
    let a = volume(dims, Data::U64(vec![u64::MAX, 1 << 60, 0]));
    let b = volume(dims, Data::I64(vec![-1, (1 << 60) + 1, 0]));
    let d = of(&a, &b);
    assert_eq!(d.differing, 2);
    assert_eq!(d.amounts.expect("numbers").max, 2f64.powi(64));
    let labels = d.labels.expect("whole numbers");
    assert_eq!(labels.last().map(|l| l.label), Some(i128::from(u64::MAX)));
    assert!(serde_json::to_value(&labels).is_ok());
}

#[test]
fn what_is_no_number_is_counted_apart() {
    let dims = [4, 1, 1];
    let (nan, inf) = (f64::NAN, f64::INFINITY);
    let d = of(
        &volume(dims, Data::F64(vec![nan, inf, 1.0, 2.0])),
        &volume(dims, Data::F64(vec![nan, 1.0, nan, 2.5])),
    );
    let amounts = d.amounts.expect("numbers");
    assert_eq!((d.differing, amounts.undefined, amounts.max), (3, 2, 0.5));
    assert_eq!(amounts.mean, 0.25);
    assert_eq!(d.warnings()[0].count, 2);
}

#[test]
fn frames_are_compared_in_voxels() {
    let dims = [11, 5, 3];
    for size in [1e-200, 1e-30, 1.0, 1e30, 1e200] {
        let scaled = |v: Vec3| v.map(|c| c * size);
        let frame = |origin, spacing| Frame::straight(dims, scaled(origin), scaled(spacing));
        let data = Data::Bits(BitGrid::new(dims));
        let a = Volume {
            frame: frame([5.0, 0.0, 0.0], [1.0, 2.0, 0.5]),
            data: data.clone(),
        };
        let b = Volume {
            frame: frame([5.5, 0.0, 1.0], [1.0, 2.25, 0.5]),
            data,
        };
        let d = of(&a, &b);
        assert!(
            (d.origin_difference - 2.0).abs() < 1e-12,
            "{size:e} {}",
            d.origin_difference
        );
        assert!(
            (d.axes_difference - 0.5).abs() < 1e-12,
            "{size:e} {}",
            d.axes_difference
        );
        assert!(!d.identical && d.differing == 0);
        assert_eq!(d.warnings()[0].code, "frames-differ");
        assert_eq!(of(&a, &a).warnings(), []);
    }
}

#[test]
fn other_dimensions_are_refused_with_both() {
    let a = volume([2, 1, 1], Data::U8(vec![0, 1]));
    let b = volume([1, 2, 1], Data::U8(vec![0, 1]));
    let error = compare(&a, &b, &Params::DEFAULT, &Silent).expect_err("different dims");
    let said = "volume A has 2 x 1 x 1 voxels, volume B has 1 x 2 x 1";
    assert_eq!(error.to_string(), said);
    assert!(error.hint().is_some());
    let short = volume([2, 1, 1], Data::U8(vec![0]));
    assert!(compare(&short, &a, &Params::DEFAULT, &Silent).is_err());
}

proptest! {
    #[test]
    fn bits_and_numbers_and_threads_agree(seed in any::<u64>(), nx in 0usize..140, ny in 0usize..9, nz in 0usize..9) {
        let dims = [nx, ny, nz];
        let count = nx * ny * nz;
        let bit = |salt: u64, at: usize| Rng::new(seed ^ salt, at as u64).unit() < 0.3;
        let numbers = |salt| (0..count).map(|at| u8::from(bit(salt, at))).collect::<Vec<u8>>();
        let dense = |salt| volume(dims, Data::Bits(grid(dims, |at| bit(salt, at))));
        let as_bits = of(&dense(0), &dense(1));
        let as_bytes = of(&volume(dims, Data::U8(numbers(0))), &volume(dims, Data::U8(numbers(1))));
        let mixed = of(&dense(0), &volume(dims, Data::F64(numbers(1).iter().map(|n| f64::from(*n)).collect())));
        for other in [&as_bytes, &mixed] {
            prop_assert_eq!(&as_bits.labels, &other.labels);
            prop_assert_eq!((as_bits.differing, as_bits.first), (other.differing, other.first));
        }
        let pool = rayon::ThreadPoolBuilder::new().num_threads(5).build().expect("a pool");
        prop_assert_eq!(pool.install(|| of(&dense(0), &dense(1))), as_bits);
    }
}
