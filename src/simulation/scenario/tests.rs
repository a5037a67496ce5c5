use super::*;

#[test]
fn every_embedded_scenario_makes_a_run_as_long_as_its_path() {
    for name in models::names(Room::Scenario) {
        let scenario = Scenario::load(name).unwrap_or_else(|error| panic!("{name}: {error}"));
        let imu = scenario
            .simulate(scenario.seed, 0)
            .unwrap()
            .run
            .recording
            .imu;
        let missing = scenario.duration().unwrap() - imu.duration();
        assert!(
            (-1e-6..imu.period).contains(&missing),
            "{name}: {missing} s"
        );
    }
}

#[test]
fn every_embedded_model_can_be_read() {
    let site = Site::with_normal_gravity(0.6, 0.0, 0.0);
    let place = &Place::Embedded;
    for name in models::names(Room::Imu) {
        Instrument::load(name, place).unwrap();
    }
    for name in models::names(Room::Installation) {
        let form = InstallationModel::load(name, place).unwrap().form;
        assert_eq!(form.name(), name);
    }
    for name in models::names(Room::Turntable) {
        models::turntable(name, place).unwrap();
    }
    for name in models::names(Room::Path) {
        models::path(name, place, &site).unwrap();
    }
}

#[test]
fn a_path_that_the_table_cannot_follow_is_refused_when_it_is_named() {
    let refused = |path: &str| {
        let scenario = Scenario::load("demo").unwrap();
        scenario.with_path(path).unwrap_err().to_string()
    };
    assert!(refused("two-axis").contains("2 angles for a table with 3 axes"));
    let mut file = tempfile::NamedTempFile::new().unwrap();
    std::io::Write::write_all(
        &mut file,
        b"first_dwell_s = 1e12\n[axes]\nstart_deg = [0, 0, 0]\nrate_deg_per_s = 1\n\
          acceleration_deg_per_s2 = 1\ndwell_s = 0\nsteps = []",
    )
    .unwrap();
    assert!(refused(file.path().to_str().unwrap()).contains("samples, expected 2 to"));
}

#[test]
fn given_values_replace_the_draw_and_leave_the_prior() {
    let drawn = Scenario::load("demo").unwrap();
    let mut given = drawn.clone();
    given.given.gyro.scale = Some(Vector3::new(1.0, 2.0, 3.0) * PPM);
    let [drawn, given] = [drawn, given].map(|scenario| scenario.simulate(1, 0).unwrap());
    assert_eq!(given.truth.gyro.scale.y, 1.0 + 2.0 * PPM);
    assert_eq!(given.truth.gyro.bias, drawn.truth.gyro.bias);
    assert_eq!(given.truth.gyro.angles, drawn.truth.gyro.angles);
    assert_eq!(given.truth.accel, drawn.truth.accel);
    assert_eq!(given.run.instrument.prior, drawn.run.instrument.prior);
}
