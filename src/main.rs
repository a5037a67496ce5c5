//! The `turncal` command.

use std::path::Path;
use turncal::{calibration, imu::InstallationForm, run::Run};

fn main() -> anyhow::Result<()> {
    let path = std::env::args().nth(1).unwrap();
    let t = std::time::Instant::now();
    let run = Run::read(Path::new(&path))?;
    eprintln!("read {:?}, {} dwells", t.elapsed(), run.dwells().len());
    let t = std::time::Instant::now();
    let out = calibration::estimate(&run, InstallationForm::General, &|p| eprintln!("{p:?}"))?;
    eprintln!(
        "estimate {:?} {:?} {} {:?}",
        t.elapsed(),
        out.consistency,
        out.velocity_sigma,
        out.warnings
    );
    let dest = std::env::args().nth(2).unwrap();
    std::fs::write(&dest, out.record(&run).to_json(Path::new(&dest))?)?;
    Ok(())
}
