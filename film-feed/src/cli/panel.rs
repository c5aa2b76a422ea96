//! `film-feed panel`: the commissioning panel in the browser.

use std::net::SocketAddr;

use clap::Args;

use super::model::ModelArgs;
use crate::panel::{Access, Panel, serve};
use crate::rig::RigConfig;

/// What `film-feed panel` takes.
#[derive(Debug, Args)]
pub struct PanelArgs {
    /// Address to listen on; another than loopback needs --token.
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1:8930")]
    listen: SocketAddr,
    /// What a page must know to be let in, 16 characters or more of A–Z, a–z, 0–9, - and _: open the page with ?token=….
    #[arg(long, value_name = "SECRET")]
    token: Option<String>,
    /// Seed of everything random.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    model: ModelArgs,
}

/// Serves until the process is ended.
///
/// # Errors
/// One sentence.
pub fn run(args: &PanelArgs) -> Result<bool, String> {
    let access = Access::new(args.listen, args.token.clone()).map_err(|error| error.to_string())?;
    let mut rig = RigConfig {
        seed: args.seed,
        ..RigConfig::default()
    };
    args.model.apply(&mut rig);
    let token = args
        .token
        .as_ref()
        .map_or(String::new(), |token| format!("/?token={token}"));
    serve(Panel { access, rig }, |at| {
        println!("panel at http://{at}{token}; Ctrl-C ends it")
    })
    .map(|()| true)
    .map_err(|error| error.to_string())
}
