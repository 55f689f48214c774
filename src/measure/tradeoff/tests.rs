use super::*;
use crate::progress::Silent;
use std::cell::{Cell, RefCell};

fn grid(shape: &[&[f64]]) -> Grid {
    let axes = shape.iter().map(|numbers| Axis {
        count: numbers.len(),
        numbers: Some(numbers.to_vec()),
    });
    Grid {
        axes: axes.collect(),
        idle: Vec::new(),
    }
}

/// A machine on which a run takes what `seconds` says, ten times that to verify.
struct Machine<'a> {
    now: Cell<f64>,
    log: RefCell<Vec<(Vec<usize>, bool)>>,
    seconds: &'a dyn Fn(&[usize]) -> f64,
    error: &'a dyn Fn(&[usize]) -> Option<f64>,
}

impl<'a> Machine<'a> {
    fn new(
        seconds: &'a dyn Fn(&[usize]) -> f64,
        error: &'a dyn Fn(&[usize]) -> Option<f64>,
    ) -> Self {
        Machine {
            now: Cell::new(100.0),
            log: RefCell::default(),
            seconds,
            error,
        }
    }

    fn run(&self, grid: &Grid, params: &Params) -> Vec<Row> {
        let mut runner = |setting: &[usize], verify: bool| {
            let wall_s = (self.seconds)(setting) * if verify { 10.0 } else { 1.0 };
            self.now.set(self.now.get() + wall_s);
            self.log.borrow_mut().push((setting.to_vec(), verify));
            let error = (self.error)(setting).ok_or_else(|| Failed {
                code: 5,
                message: "too large".to_owned(),
            })?;
            Ok(Ran {
                wall_s,
                cpu_s: 2.0 * wall_s,
                peak_bytes: Some(1000 * (setting[0] as u64 + 1)),
                error: verify.then_some(error),
                bound: Some(1.0),
                modelled: None,
            })
        };
        super::run(grid, params, &mut runner, &|| self.now.get(), &Silent)
    }
}

#[test]
fn all_are_verified_then_timed_to_and_fro() {
    let machine = Machine::new(&|s| 1.0 + s[0] as f64, &|s| Some(1.0 / (1 + s[0]) as f64));
    let rows = machine.run(&grid(&[&[1.0, 2.0, 3.0]]), &Params::DEFAULT);
    let order: Vec<(usize, bool)> = machine
        .log
        .borrow()
        .iter()
        .map(|(s, v)| (s[0], *v))
        .collect();
    let timed = [0, 1, 2, 2, 1, 0, 0, 1, 2];
    let wanted: Vec<_> = [0, 1, 2]
        .map(|i| (i, true))
        .into_iter()
        .chain(timed.map(|i| (i, false)))
        .collect();
    assert_eq!(order, wanted);
    assert!(rows.iter().all(|r| r.status == Status::Done && r.runs == 3));
    assert!(rows.iter().all(|r| r.on_front));
    assert_eq!(rows[1].error, Some(0.5));
    let two = Spread {
        median: 2.0,
        min: 2.0,
        max: 2.0,
    };
    assert_eq!(rows[1].wall_s, Some(two));
    assert_eq!(rows[2].rank, Some(3));
}

#[test]
fn settings_stand_after_all_that_are_cheaper_in_every_knob() {
    let settings = grid(&[&[1.0, 2.0, 3.0], &[1.0, 2.0], &[1.0, 2.0, 4.0]]).settings();
    assert_eq!(settings.len(), 18);
    for (i, a) in settings.iter().enumerate() {
        for b in &settings[i + 1..] {
            assert!(!b.iter().zip(a).all(|(b, a)| b <= a), "{a:?} before {b:?}");
        }
    }
    assert_eq!(grid(&[]).settings(), [Vec::<usize>::new()]);
}

#[test]
fn a_knob_without_effect_stays_where_it_is() {
    let mut grid = grid(&[&[1.0, 2.0], &[1.0, 2.0, 3.0]]);
    grid.idle = vec![Idle {
        axis: 1,
        by: 0,
        value: 1,
    }];
    let settings = grid.settings();
    let found: Vec<&[usize]> = settings.iter().map(Vec::as_slice).collect();
    assert_eq!(found, [[0, 0], [0, 1], [1, 0], [0, 2]]);
    assert!(grid.is_idle(&[1, 2], 1) && !grid.is_idle(&[0, 2], 1) && !grid.is_idle(&[1, 2], 0));
}

#[test]
fn a_setting_that_fails_is_a_row_and_is_not_timed() {
    let machine = Machine::new(&|_| 1.0, &|s| (s[0] != 1).then_some(0.5));
    let rows = machine.run(&grid(&[&[1.0, 2.0, 3.0]]), &Params::DEFAULT);
    assert_eq!((rows[1].status, rows[1].code), (Status::Failed, 5));
    assert_eq!(rows[1].message.as_deref(), Some("too large"));
    assert_eq!((rows[1].rank, rows[1].on_front), (None, false));
    let runs = machine
        .log
        .borrow()
        .iter()
        .filter(|(s, _)| s[0] == 1)
        .count();
    assert_eq!(runs, 1);
    // Two of one cost and one error: the first is on the front.
    assert_eq!((rows[0].on_front, rows[2].on_front), (true, false));
}

#[test]
fn a_budget_takes_the_cheapest_first_and_is_not_overrun() {
    let numbers: Vec<f64> = (0..6).map(|i| f64::from(1 << i)).collect();
    let shape: [&[f64]; 2] = [&numbers, &[1.0, 2.0]];
    let seconds = |s: &[usize]| 0.1 * 8f64.powi(s[0] as i32) * (1 + s[1]) as f64;
    for budget in [5.0, 50.0, 500.0, 5000.0] {
        let machine = Machine::new(&seconds, &|s| Some(1.0 / (1 << s[0]) as f64));
        let params = Params {
            budget_s: Some(budget),
            ..Params::DEFAULT
        };
        let rows = machine.run(&grid(&shape), &params);
        let spent = machine.now.get() - 100.0;
        assert!(spent <= budget, "{spent} of {budget}");
        assert!(spent > 0.05 * budget, "{spent} of {budget}");
        let done: Vec<_> = rows.iter().filter(|r| r.status == Status::Done).collect();
        assert!(!done.is_empty() && done.iter().all(|r| r.runs == 3));
        let dearest = done.iter().map(|r| seconds(&r.setting)).fold(0.0, f64::max);
        for row in rows.iter().filter(|r| r.status == Status::NotRun) {
            assert!(seconds(&row.setting) >= 0.5 * dearest, "{:?}", row.setting);
            assert!(row.message.is_some());
        }
    }
}

#[test]
fn what_a_step_took_beside_tells_what_it_will_take() {
    // Numbers are taken to cost by the cube while nothing is known; here they hardly cost more.
    let seconds = |s: &[usize]| 1.2f64.powi(s[0] as i32) * (1.0 + 0.1 * s[1] as f64);
    let machine = Machine::new(&seconds, &|s| Some(1.0 / (1 + s[0]) as f64));
    let params = Params {
        budget_s: Some(900.0),
        ..Params::DEFAULT
    };
    let rows = machine.run(&grid(&[&[1.0, 4.0, 16.0], &[1.0, 1.1, 1.2]]), &params);
    assert!(
        rows.iter()
            .all(|row| row.status == Status::Done && row.runs == 3)
    );
}

#[test]
fn the_first_is_run_whatever_the_budget() {
    let machine = Machine::new(&|_| 1.0, &|_| Some(0.5));
    let params = Params {
        budget_s: Some(1e-3),
        ..Params::DEFAULT
    };
    let rows = machine.run(&grid(&[&[1.0, 2.0]]), &params);
    assert_eq!((rows[0].status, rows[0].runs), (Status::Done, 1));
    let message = rows[0].message.as_deref();
    assert_eq!(message, Some("1 of 3 timed runs, for want of time"));
    assert_eq!(rows[1].status, Status::NotRun);
}

#[test]
fn the_choice_keeps_to_every_limit() {
    let machine = Machine::new(&|s| 1.0 + s[0] as f64, &|s| Some(1.0 / (1 + s[0]) as f64));
    let rows = machine.run(&grid(&[&[1.0, 2.0, 3.0, 4.0]]), &Params::DEFAULT);
    let choose = |max_error, max_seconds, max_memory| {
        let limits = Limits {
            max_error,
            max_seconds,
            max_memory,
        };
        super::choose(&rows, &limits, Cost::Wall)
    };
    assert_eq!(choose(None, None, None), Choice::NotAsked);
    assert_eq!(choose(Some(0.5), None, None), Choice::Row(1));
    assert_eq!(choose(Some(0.1), None, None), Choice::None);
    assert_eq!(choose(None, Some(3.0), None), Choice::Row(2));
    assert_eq!(choose(None, None, Some(2000)), Choice::Row(1));
    assert_eq!(choose(None, Some(4.0), Some(1999)), Choice::Row(0));
    assert_eq!(choose(Some(0.4), Some(3.0), None), Choice::Row(2));
    assert_eq!(choose(Some(0.4), Some(2.9), None), Choice::None);
}

#[test]
fn a_spread_is_the_middle_and_the_ends() {
    assert_eq!(Spread::of(&[]), None);
    let spread = Spread::of(&[3.0, 1.0, 2.0, 10.0]).expect("figures");
    assert_eq!((spread.median, spread.min, spread.max), (2.5, 1.0, 10.0));
}
