//! `bthc verify`: checks a compiled file completely.

use crate::args::Verify;
use crate::failure::{Failure, runtime_json};
use crate::output;
use crate::table::{Table, bytes, count};
use bth_format::verify::Report;
use serde_json::json;

pub(crate) fn run(args: &Verify) -> Result<(), Failure> {
    let result = match bth_format::File::read(&args.file) {
        Ok(file) => bth_format::verify::verify(&file),
        Err(error) if error.code() == bth::Code::Read => return Err(error.into()),
        Err(error) => Err(vec![error]),
    };
    match result {
        Ok(report) if args.json => Ok(output::json(&passed(&report))?),
        Ok(report) => Ok(output::text(&summary(&report))?),
        Err(errors) => {
            if args.json {
                let errors: Vec<_> = errors.iter().map(runtime_json).collect();
                output::json(&json!({"verified": false, "errors": errors}))?;
            } else {
                errors.iter().for_each(|error| output::error(&format!("{}: {error}", args.file.display())));
            }
            Err(Failure::Check)
        }
    }
}

fn passed(report: &Report) -> serde_json::Value {
    json!({
        "verified": true,
        "objects": report.objects,
        "sections": report.sections,
        "bytes": report.bytes,
        "triangles": report.triangles,
        "dropped": report.dropped,
        "tet_leaves": report.tet_leaves,
        "tets": report.tets,
        "compared_with_source": report.compared_with_source,
    })
}

fn summary(report: &Report) -> String {
    let mut table = Table::default();
    table.row(["objects", &count(report.objects.into())]);
    table.row(["sections", &count(report.sections)]);
    table.row(["file", &bytes(report.bytes)]);
    table.row(["triangles", &count(report.triangles)]);
    table.row(["dropped", &count(report.dropped)]);
    table.row(["tet leaves", &count(report.tet_leaves)]);
    table.row(["tetrahedra", &count(report.tets)]);
    let compared = report.compared_with_source == report.objects;
    let source = if compared {
        "compared with the source's triangles"
    } else {
        "the file keeps no source to compare with"
    };
    format!("{}verified; {source}\n", table.render())
}
