//! Report on Table 1 of the paper: tables and verdicts, and Figures 2 to 9 of the paper.

mod figures;
mod verdict;

use crate::prelude::*;
use turncal::study::Table1;
use turncal::study::table1::{AGREEMENT, ByQuantity, Column, Moments, QUANTITIES, Row, paper};

/// Figures smaller than this, in the units shown, are shown as zero.
const ZERO: f64 = 5e-10;
/// Differences of more than this many standard errors are shown only as larger.
const MANY: f64 = 100.0;

/// The complete report on the study.
pub fn document(table: &Table1) -> Document {
    let title = "Cost of a simplified misalignment form: Table 1 of the paper";
    let mut document = Document::new(title);
    document.conclusions = List::new("Verdict", verdict::sentences(table));
    document.both(facts(table));
    for column in &table.columns {
        document.both(of_column(table, column));
    }
    document.both(List::new("How to read the tables", notes(table)));
    document.pages(figures::figures(table));
    document.data = data(table);
    document
}

fn facts(table: &Table1) -> Facts {
    let study = &table.study;
    let mut samples = format!("{}, seed {}", count(study.samples), study.seed);
    if table.population > study.samples {
        let population = count(table.population);
        samples += &format!(
            "; the verdicts are based on {population} samples, of which these are the first"
        );
    }
    let source =
        "Zhao, Jiang, Li, The IMU Calibration Mathematical Modeling and Error Analysis, 2016, §3.2";
    let truth = "six angles of ±0.1° per triad, rows of unit norm; no noise, no pulses";
    let navigation = format!(
        "stationary and level for {} h at latitude {:.2}°, fixed height, perfect alignment",
        three_digits(study.hours),
        study.latitude / DEGREE
    );
    let mut facts = Facts::new("The study", [("source", source)]);
    facts.push("samples", samples);
    facts.push("truth", truth);
    facts.push("navigation", navigation);
    facts
}

fn notes(table: &Table1) -> Vec<String> {
    let mut notes = vec![
        "Figures: largest absolute error of the run, mean and standard deviation over samples; velocity and position \
         are horizontal norms. 0 means less than 5e-10."
            .to_owned(),
        format!(
            "z: mean of the paper minus mean of {} samples, divided by the standard error of the difference, s \
             √(1/{} + 1/{}), where s is from these samples. Means agree if |z| ≤ {AGREEMENT} (99 %).",
            count(table.population),
            paper::SAMPLES,
            table.population
        ),
        "The paper states no latitude; 45.78° follows from its accelerometer rows, where heading divided by roll is \
         tan L."
            .to_owned(),
    ];
    let (hours, latitude) = (table.study.hours, table.study.latitude / DEGREE);
    if (hours - paper::HOURS).abs() > 1e-9 || (latitude - paper::LATITUDE_DEG).abs() > 1e-9 {
        notes.push(format!(
            "The runs in the paper last {} h at about {}°, so the conditions differ from those here.",
            paper::HOURS,
            paper::LATITUDE_DEG
        ));
    }
    notes
}

fn figure(of: f64) -> String {
    if of.abs() < ZERO {
        "0".to_owned()
    } else {
        three_digits(of)
    }
}

fn of_column(table: &Table1, column: &Column) -> Block {
    let quantities = QUANTITIES.map(|q| format!("{}, {}", q.short(), q.unit()));
    let headings = cells!["reading", ""].into_iter().chain(quantities);
    let headings = headings.chain(["the paper's figures".to_owned()]);
    let paper_name = format!("paper, {} samples", paper::SAMPLES);
    let sections = column.rows().map(|row| {
        let mut lines = pair(row.reading.name, &row.sample, &verdict::of_row(column, row));
        if table.population > table.study.samples {
            let of = format!("mean of {}", count(table.population));
            lines.push(line("", &of, row.population.map(|of| figure(of.mean)), ""));
        }
        lines.push(line("", "z", row.difference.map(standard_errors), ""));
        lines
    });
    Table::new(verdict::title(column.published), headings)
        .section(pair(&paper_name, &column.published.moments(), ""))
        .sections(sections)
        .into()
}

/// Mean and standard deviation.
fn pair(name: &str, moments: &ByQuantity<Moments>, verdict: &str) -> Vec<Vec<String>> {
    let [mean, std] = [moments.map(|of| of.mean), moments.map(|of| of.std)];
    vec![
        line(name, "mean", mean.map(figure), verdict),
        line("", "std", std.map(figure), ""),
    ]
}

fn line(name: &str, what: &str, figures: ByQuantity<String>, verdict: &str) -> Vec<String> {
    [cells![name, what], figures.to_vec(), cells![verdict]].concat()
}

fn standard_errors(z: f64) -> String {
    match z.abs() > MANY {
        true if z > 0.0 => format!("> {MANY}"),
        true => format!("< −{MANY}"),
        false => value(z, 1.0),
    }
}

/// Figures by name, in the units of the keys.
fn data(table: &Table1) -> Value {
    let (study, columns) = (&table.study, &table.columns);
    let rows = |column| Column::rows(column).map(move |row| reading(column, row));
    let rows = columns.iter().flat_map(rows);
    json!({
        "samples": study.samples,
        "seed": study.seed,
        "latitude_deg": study.latitude / DEGREE,
        "hours": study.hours,
        "population": table.population,
        "agreement_z": AGREEMENT,
        "rows": rows.collect::<Value>(),
        "verdicts": columns.iter().map(|column| json!({
            "sensor": column.published.sensor.name(),
            "form": column.published.form,
            "verdict": verdict::short(&column.verdict),
            "explanation": verdict::sentence(column),
        })).collect::<Value>(),
    })
}

fn reading(column: &Column, row: &Row) -> Value {
    let paper = column.published.moments();
    let mean = |moments: &ByQuantity<Moments>| by_key(moments.map(|of| of.mean));
    let std = |moments: &ByQuantity<Moments>| by_key(moments.map(|of| of.std));
    json!({
        "sensor": column.published.sensor.name(),
        "form": column.published.form,
        "reading": row.reading.name,
        "hours": row.hours,
        "mean": mean(&row.sample),
        "std": std(&row.sample),
        "paper_mean": mean(&paper),
        "paper_std": std(&paper),
        "population_mean": mean(&row.population),
        "population_std": std(&row.population),
        "z": by_key(row.difference),
        "agrees": by_key(std::array::from_fn(|q| row.agrees(q))),
        "verdict": verdict::of_row(column, row),
    })
}

fn by_key<T: Into<Value>>(of: ByQuantity<T>) -> Map<String, Value> {
    let all = QUANTITIES.into_iter().zip(of);
    all.map(|(quantity, of)| (quantity.key.to_owned(), of.into()))
        .collect()
}

#[cfg(test)]
mod tests {
    use std::sync::OnceLock;

    use super::super::{svg, terminal};
    use super::*;
    use turncal::study::Table1Study;

    fn small() -> &'static Table1 {
        static TABLE: OnceLock<Table1> = OnceLock::new();
        TABLE.get_or_init(|| {
            let study = Table1Study {
                samples: 60,
                seed: 4,
                hours: 40.0,
                latitude: 45.78 * DEGREE,
            };
            study.run().unwrap()
        })
    }

    #[test]
    fn every_figure_of_the_paper_is_drawn() {
        let document = document(small());
        let drawn = svg::drawn(document.plots());
        let names: Vec<&str> = document.plots().map(|plot| plot.file.as_str()).collect();
        assert_eq!(
            names,
            [2, 3, 4, 5, 6, 7, 8, 9].map(|k| format!("figure-{k}.svg"))
        );
        // Fifty courses, their mean and ±σ in each panel, beside grids.
        let lines: Vec<usize> = drawn
            .iter()
            .map(|svg| svg.matches("<polyline").count())
            .collect();
        assert!(lines.iter().all(|&n| n > 2 * 51), "{lines:?}");
    }

    #[test]
    fn each_figure_stands_beside_the_papers_with_its_verdict() {
        let text = terminal::text(&document(small()), None);
        assert!(!text.contains("NaN") && !text.contains("inf"));
        for expected in [
            "39.4",
            "0.000000055",
            "Gyros, six-angle form (Eq. 8): not reproducible by a correct program, which gives zero",
            "a slip reproduces the figures in the paper: E_zy of the wrong sign",
            "Gyros, three-angle form (Eq. 10): not reproduced as stated, but under another reading: angles ±0.2°, 48 \
             h. With angles ±0.2° all agree except position",
            "Accelerometers, six-angle form (Eq. 8): zero except for rounding",
            "Accelerometers, three-angle form (Eq. 10): reproduced as stated",
        ] {
            assert!(text.contains(expected), "no {expected:?} in\n{text}");
        }
        insta::assert_snapshot!(terminal::text(&document(small()), Some(100)));
    }

    #[test]
    fn data_give_every_reading_in_the_units_of_their_keys() {
        let data = document(small()).data;
        assert_eq!(data["samples"], 60);
        let rows = data["rows"].as_array().unwrap();
        assert_eq!(rows.len(), 12);
        let stated = &rows[3];
        let of = |key: &str| stated[key].as_str();
        assert_eq!(
            (of("sensor"), of("form")),
            (Some("gyro"), Some("three-angle"))
        );
        let paper = stated["paper_mean"]["position_nmile"].as_f64().unwrap();
        assert!((paper - 39.42).abs() < 1e-12, "{paper}");
        let mean = small().columns[1].stated.sample[4].mean;
        assert_eq!(stated["mean"]["position_nmile"], mean);
    }
}
