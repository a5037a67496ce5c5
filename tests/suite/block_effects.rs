//! What blocks of states explain: the data ask for the right one.

use rayon::prelude::*;
use turncal::calibration::{
    BlockEffect, CalibrationError, Outcome, batch_estimate, block_effects, estimate,
};
use turncal::imu::{InstallationForm, Term};
use turncal::calibration::StateBlock;
use turncal::run::Run;
use turncal::simulation::Scenario;

/// Fixed before the first run was made.
const SEED: u64 = 23;
const ORDER: StateBlock = StateBlock::Term(Term::AccelSecondOrder);

fn calibrated(run: &Run) -> (Outcome, Vec<BlockEffect>) {
    let outcome = estimate(run, InstallationForm::General, &|_| {}).unwrap();
    let effects = block_effects(run, &outcome).unwrap();
    (outcome, effects)
}

#[test]
fn the_data_ask_most_for_the_block_whose_errors_they_have_and_for_none_where_there_are_none() {
    let asked = |unmodelled: Option<StateBlock>| {
        let mut scenario = Scenario::load("demo").unwrap();
        if let Some(block) = unmodelled {
            scenario = scenario.with_block(block);
        }
        // The usual wandering is not told from white noise within ten minutes; five times as much is.
        let noise = &mut scenario.instrument.noise;
        for noise in [&mut noise.gyro, &mut noise.accel] {
            if let Some(instability) = &mut noise.instability {
                instability.sigma *= 5.0;
            }
        }
        let mut run = scenario.simulate(SEED, 0).unwrap().run;
        for block in StateBlock::ALL {
            run.switch_off(block);
        }
        let (_, effects) = calibrated(&run);
        assert!(effects.iter().all(|effect| !effect.on));
        let asked = effects.into_iter().filter(BlockEffect::asked_for);
        let most = asked.max_by(|a, b| a.gain.total_cmp(&b.gain));
        (unmodelled, most.map(|effect| effect.block))
    };
    let all: Vec<_> = StateBlock::ALL
        .into_iter()
        .map(Some)
        .chain([None])
        .collect();
    let found: Vec<_> = all.into_par_iter().map(asked).collect();
    for (unmodelled, most) in found {
        println!("{unmodelled:?}: {most:?}");
        assert_eq!(unmodelled, most);
    }
}

#[test]
fn a_batch_refuses_a_run_with_states_that_it_does_not_have() {
    let scenario = Scenario::load("demo").unwrap();
    let mut run = scenario.simulate(SEED, 0).unwrap().run;
    let (outcome, _) = calibrated(&run);
    assert!(batch_estimate(&run, &outcome).is_ok());
    run.switch_on(ORDER);
    let refused = batch_estimate(&run, &outcome).unwrap_err();
    assert_eq!(refused, CalibrationError::NotInBatch { block: ORDER });
    assert!(refused.to_string().contains("accel-second-order"));
}
