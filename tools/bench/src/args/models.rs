//! The models that a command measures, and where its cameras stand.

use crate::rays::View;
use clap::Args;

/// The models, and where the cameras stand.
#[derive(Debug, Args)]
pub struct Models {
    /// Model files, or models of `bth-scenes list` by NAME or NAME:FACES.
    #[arg(required = true, value_name = "MODEL")]
    pub models: Vec<String>,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub seen_from: SeenFrom,
}

/// Where the cameras stand.
#[derive(Clone, Copy, Debug, Default, Args)]
pub struct SeenFrom {
    /// Stand within the models, as is right for rooms; without this and --outside each model decides.
    #[arg(long, conflicts_with = "outside")]
    pub inside: bool,
    /// Stand outside of the models.
    #[arg(long)]
    pub outside: bool,
}

impl SeenFrom {
    /// The view that the options select.
    pub fn view(&self) -> Option<View> {
        match (self.inside, self.outside) {
            (true, _) => Some(View::Inside),
            (_, true) => Some(View::Outside),
            _ => None,
        }
    }
}
