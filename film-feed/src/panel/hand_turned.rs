//! The panel without server, thread and clock.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::Duration;

use tokio::sync::mpsc;

use super::engine::{Heard, QUEUE, ToEngine};
use super::hub::Hub;
use super::protocol::Order;
use super::simulated::Plant;
use crate::operator::FeedPlan;
use crate::rig::{RigConfig, RigError};

/// The simulated machine with its pages, turned by whoever holds it: texts of the pages in, texts for the pages out, and time passes when
/// [`turn`](Self::turn) says so. What a page may say and is told is in [`protocol`](super::protocol).
///
/// ```
/// use std::time::Duration;
///
/// use film_feed::operator::FeedPlan;
/// use film_feed::panel::HandTurned;
/// use film_feed::rig::RigConfig;
///
/// let mut panel = HandTurned::new(RigConfig::default(), &FeedPlan::default()).unwrap();
/// panel.join(1);
/// panel.say(1, r#"{"do":"set","input":"enable","value":1}"#).unwrap();
/// panel.turn(Duration::from_millis(50));
/// // Hello, who has the control, a frame.
/// assert_eq!(panel.heard(1).len(), 3);
/// assert!(panel.say(1, "please").is_err());
/// ```
pub struct HandTurned {
    hub: Hub,
    pages: HashMap<u64, mpsc::Receiver<Arc<str>>>,
}

impl std::fmt::Debug for HandTurned {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("HandTurned").field("pages", &self.pages.len()).finish()
    }
}

impl HandTurned {
    /// The chain at power-up, at real time, the inputs of the block filled in as planned.
    ///
    /// # Errors
    ///
    /// [`RigError`] when the configuration is impossible.
    pub fn new(config: RigConfig, plan: &FeedPlan) -> Result<Self, RigError> {
        let plant = Plant::new(config, plan, Heard::default(), |_| {})?;
        Ok(Self {
            hub: Hub::new(Box::new(plant)),
            pages: HashMap::new(),
        })
    }

    /// A page comes, under any number; one that is there already comes anew.
    pub fn join(&mut self, page: u64) {
        self.leave(page);
        let (to_page, for_page) = mpsc::channel(QUEUE);
        self.pages.insert(page, for_page);
        self.hub.handle(ToEngine::Joined(page, to_page));
    }

    /// A page goes.
    pub fn leave(&mut self, page: u64) {
        if self.pages.remove(&page).is_some() {
            self.hub.handle(ToEngine::Left(page));
        }
    }

    /// A page says something.
    ///
    /// # Errors
    ///
    /// The text is no [`Order`], for which the server ends a connection. What is an order and is refused is answered to the page.
    pub fn say(&mut self, page: u64, text: &str) -> Result<(), serde_json::Error> {
        let order: Order = serde_json::from_str(text)?;
        self.hub.handle(ToEngine::Wants(page, order));
        Ok(())
    }

    /// A frame of so long passes; the pages are told.
    pub fn turn(&mut self, frame: Duration) {
        self.hub.turn(frame);
    }

    /// What a page was told since the last call. Nothing, too, from when 64 texts waited for it: it was too slow and is dropped.
    pub fn heard(&mut self, page: u64) -> Vec<Arc<str>> {
        let mut heard = Vec::new();
        if let Some(for_page) = self.pages.get_mut(&page) {
            while let Ok(text) = for_page.try_recv() {
                heard.push(text);
            }
        }
        heard
    }
}
