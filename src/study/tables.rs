//! The study and the label as CSV and JSON.

use std::fmt::Write;

use serde_json::{Value, json};

use super::label::PrecisionLabel;
use super::run::Study;

/// Errors in this order everywhere: metres, radians, pixels, pixels.
const QUANTITIES: [&str; 4] = ["position_m", "rotation_rad", "focal_px", "principal_point_px"];

/// A number that JSON can hold; `null` for what is infinite.
fn number(v: f64) -> Value {
    serde_json::Number::from_f64(v).map_or(Value::Null, Value::Number)
}

fn numbers(values: &[f64]) -> Value {
    values.iter().map(|v| number(*v)).collect()
}

fn header(csv: &mut String, kind: &str) {
    for quantity in QUANTITIES {
        let _ = write!(csv, ",{kind}_{quantity}");
    }
}

fn row(csv: &mut String, values: &[f64]) {
    for v in values {
        let _ = write!(csv, ",{v}");
    }
}

impl Study {
    /// A line for each method and level.
    pub fn to_csv(&self) -> String {
        let mut csv = "method,head_px,fixed_px,used,failures".to_owned();
        ["mean", "rms", "bias", "expected"].iter().for_each(|kind| header(&mut csv, kind));
        for d in &self.options.distances {
            let _ = write!(csv, ",handoff_rms_m_at_{d}_m");
        }
        csv.push('\n');
        for (i, cell) in self.cells.iter().enumerate() {
            let name = cell.method.name();
            let _ = write!(csv, "\"{name}\",{},{},{},{}", cell.level.head, cell.level.fixed, cell.used, cell.failures);
            [cell.mean, cell.rms, cell.bias].iter().for_each(|v| row(&mut csv, v));
            let expected = self.expected.get(i % self.options.levels.len());
            row(&mut csv, &expected.map_or([f64::INFINITY; 4], |e| e.rms));
            row(&mut csv, &cell.handoff);
            csv.push('\n');
        }
        csv
    }

    /// Everything but the set-up's shots; `null` where a figure is infinite.
    pub fn to_json(&self) -> String {
        let level = |l: &super::information::NoiseLevel| json!({"head_px": l.head, "fixed_px": l.fixed});
        let cells: Vec<Value> = self
            .cells
            .iter()
            .map(|c| {
                json!({
                    "method": c.method.name(), "level": level(&c.level), "used": c.used, "failures": c.failures,
                    "mean": numbers(&c.mean), "rms": numbers(&c.rms), "bias": numbers(&c.bias),
                    "handoff_rms_m": numbers(&c.handoff),
                })
            })
            .collect();
        let expected: Vec<Value> = self
            .expected
            .iter()
            .map(|e| json!({"level": level(&e.level), "rms": numbers(&e.rms), "handoff_rms_m": numbers(&e.handoff)}))
            .collect();
        json!({
            "format": "ptzcal noise study", "version": 1,
            "shots": self.set_up.shots.len(), "trials": self.options.trials, "seed": self.options.seed,
            "quantities": QUANTITIES, "distances_m": numbers(&self.options.distances),
            "cells": cells, "expected": expected,
        })
        .to_string()
    }
}

impl PrecisionLabel {
    /// A line for each distance and level.
    pub fn to_csv(&self) -> String {
        let mut csv = "distance_m,head_px,fixed_px,shots,failures".to_owned();
        ["simulated", "expected"].iter().for_each(|kind| header(&mut csv, kind));
        csv.push_str(",handoff_simulated_m,handoff_expected_m\n");
        for r in &self.rows {
            let _ = write!(csv, "{},{},{},{},{}", r.distance, r.level.head, r.level.fixed, r.shots, r.failures);
            row(&mut csv, &r.simulated);
            row(&mut csv, &r.expected);
            row(&mut csv, &[r.handoff_simulated, r.handoff_expected]);
            csv.push('\n');
        }
        csv
    }

    /// The same; `null` where a figure is infinite.
    pub fn to_json(&self) -> String {
        let rows: Vec<Value> = self
            .rows
            .iter()
            .map(|r| {
                json!({
                    "distance_m": r.distance, "head_px": r.level.head, "fixed_px": r.level.fixed,
                    "shots": r.shots, "failures": r.failures,
                    "simulated": numbers(&r.simulated), "expected": numbers(&r.expected),
                    "handoff_simulated_m": number(r.handoff_simulated),
                    "handoff_expected_m": number(r.handoff_expected),
                })
            })
            .collect();
        json!({
            "format": "ptzcal precision label", "version": 1, "method": self.options.method.name(),
            "trials": self.options.trials, "seed": self.options.seed, "quantities": QUANTITIES, "rows": rows,
        })
        .to_string()
    }
}
