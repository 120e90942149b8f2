//! `bthc verify`: checks a compiled file completely.

use crate::args::Verify;
use crate::deep;
use crate::failure::Failure;
use crate::output;
use crate::progress::Progress;
use crate::table::{Table, bytes, count};
use bth_files::Diagnosis;
use bth_format::verify::Report;
use serde_json::json;
use std::num::NonZeroUsize;

pub(crate) fn run(args: &Verify) -> Result<(), Failure> {
    let result = match bth_format::File::read(&args.file) {
        Ok(file) => bth_format::verify::verify(&file),
        Err(error) if error.code() == bth::Code::Read => return Err(error.into()),
        Err(error) => Err(vec![error]),
    };
    match result {
        Ok(report) => {
            let deep = if args.deep { Some(deeply(args)?) } else { None };
            let is_right = deep.is_none_or(|deep| deep.wrong == 0);
            if args.json {
                output::json(&found(&report, deep, is_right))?;
            } else if is_right {
                output::text(&summary(&report, deep))?;
            }
            if is_right { Ok(()) } else { Err(Failure::Check) }
        }
        Err(errors) => {
            let errors: Vec<_> = errors.into_iter().map(|error| error.in_file(&args.file)).collect();
            if args.json {
                let errors: Vec<_> = errors.iter().map(Diagnosis::from).collect();
                output::json(&json!({"verified": false, "errors": errors}))?;
            } else {
                errors.iter().for_each(|error| output::error(&error.to_string()));
            }
            Err(Failure::Check)
        }
    }
}

/// Traces sample rays through each object.
fn deeply(args: &Verify) -> Result<deep::Report, Failure> {
    deep::check(&args.file, args.rays.map(NonZeroUsize::get), &Progress::new(args.json))
}

fn found(report: &Report, deep: Option<deep::Report>, is_right: bool) -> serde_json::Value {
    json!({
        "verified": is_right,
        "deep": deep.map(|deep| deep.json()),
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

fn summary(report: &Report, deep: Option<deep::Report>) -> String {
    let mut table = Table::default();
    table.row(["objects", &count(report.objects.into())]);
    table.row(["sections", &count(report.sections)]);
    table.row(["file", &bytes(report.bytes)]);
    table.count("triangles", report.triangles);
    table.count("dropped", report.dropped);
    table.count("tet leaves", report.tet_leaves);
    table.count("tetrahedra", report.tets);
    if let Some(deep) = deep {
        table.row(["rays compared", &count(deep.rays)]);
        table.row(["hits", &count(deep.hits)]);
        table.row(["known directions", &count(deep.known)]);
    }
    let source = match (report.compared_with_source, report.objects) {
        (compared, objects) if compared == objects => "compared with the source's triangles".to_owned(),
        (0, _) => "the file keeps no source to compare with".to_owned(),
        (compared, objects) => format!(
            "{compared} of {objects} objects compared with the source's triangles; the file keeps no others"
        ),
    };
    format!("{}verified; {source}\n", table.render())
}
