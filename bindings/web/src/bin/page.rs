//! Builds the page: one HTML file with style, program, worker and the engine as compressed WebAssembly.
//!
//! Usage: `page [FILE]`, by default `target/web/turncal.html`.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::{env, fs};

use anyhow::{Context, ensure};
use base64::prelude::{BASE64_STANDARD, Engine};
use flate2::{Compression, write::GzEncoder};
use wasm_bindgen_cli_support::Bindgen;

const TARGET: &str = "wasm32-unknown-unknown";
/// The stack of a main thread elsewhere; the default for this target is 1 MiB.
const STACK: &str = "link-arg=-zstack-size=8388608";
/// Symbols are removed below: the binding reads other sections that would go with them.
const STRIP: &str = "strip=debuginfo";

fn main() -> anyhow::Result<()> {
    let crate_root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let root = crate_root.join("../..");
    let target = env::var_os("CARGO_TARGET_DIR").map_or(root.join("target"), PathBuf::from);
    let page = env::args_os().nth(1);
    let page = page.map_or(target.join("web/turncal.html"), PathBuf::from);

    let (glue, wasm) = engine(&target)?;
    let read =
        |path: PathBuf| fs::read_to_string(&path).with_context(|| path.display().to_string());
    let style = read(root.join("crates/turncal-report/src/style.css"))?
        + &read(crate_root.join("page/page.css"))?;
    let scripts = ["form.js", "result.js", "page.js"];
    let program = scripts.map(|name| read(crate_root.join("page").join(name)));
    let program = program
        .into_iter()
        .collect::<Result<Vec<_>, _>>()?
        .join("\n");
    // The last part is the longest and not searched for the names of the others.
    let parts = [
        ("style", style),
        ("sensors", sensors(&root.join("models/imu"))?),
        ("program", program),
        ("worker", glue + &read(crate_root.join("page/worker.js"))?),
        ("version", env!("CARGO_PKG_VERSION").to_owned()),
        ("wasm", BASE64_STANDARD.encode(compressed(&wasm)?)),
    ];
    let mut text = read(crate_root.join("page/page.html"))?;
    for (name, part) in parts {
        let place = format!("{{{{{name}}}}}");
        ensure!(text.contains(&place), "page.html has no {place}");
        text = text.replacen(&place, &part, 1);
    }
    if let Some(directory) = page.parent() {
        fs::create_dir_all(directory)?;
    }
    fs::write(&page, &text).with_context(|| page.display().to_string())?;
    let megabytes = |bytes: usize| bytes as f64 / 1e6;
    println!(
        "{}: {:.1} MB, of which {:.1} MB WebAssembly before compression",
        page.display(),
        megabytes(text.len()),
        megabytes(wasm.len())
    );
    Ok(())
}

/// The engine, and the program through which a worker calls it.
fn engine(target: &Path) -> anyhow::Result<(String, Vec<u8>)> {
    let cargo = env::var_os("CARGO").unwrap_or("cargo".into());
    let status = Command::new(cargo)
        .args(["rustc", "--release", "--package", "turncal-web", "--lib"])
        .args(["--target", TARGET, "--", "-C", STACK, "-C", STRIP])
        .status()?;
    ensure!(status.success(), "the engine does not compile: {status}");
    let wasm = target.join(TARGET).join("release/turncal_web.wasm");
    let mut bound = Bindgen::new()
        .input_path(wasm)
        .no_modules(true)?
        .typescript(false)
        .remove_name_section(true)
        .remove_producers_section(true)
        .generate_output()?;
    let glue = bound.js().to_owned();
    Ok((glue, bound.wasm_mut().emit_wasm()))
}

fn compressed(bytes: &[u8]) -> anyhow::Result<Vec<u8>> {
    let mut gzip = GzEncoder::new(Vec::new(), Compression::best());
    gzip.write_all(bytes)?;
    Ok(gzip.finish()?)
}

/// The instruments with an embedded data sheet, as options of the form.
fn sensors(folder: &Path) -> anyhow::Result<String> {
    let mut names = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        names.extend(
            path.file_stem()
                .map(|name| name.to_string_lossy().into_owned()),
        );
    }
    names.sort();
    let options = names.iter().map(|name| format!("<option>{name}</option>"));
    Ok(options.collect())
}
