//! The pages, and who of them may change something. Knows no thread and no clock.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::Duration;

use tokio::sync::mpsc;

use super::engine::{ClientId, Source, ToEngine};
use super::protocol::{Order, Told};

/// Pages, and who of them may change something.
pub(super) struct Hub {
    source: Box<dyn Source>,
    clients: HashMap<ClientId, mpsc::Sender<Arc<str>>>,
    control: Option<ClientId>,
    seq: u64,
}

impl Hub {
    pub(super) fn new(source: Box<dyn Source>) -> Self {
        Self {
            source,
            clients: HashMap::new(),
            control: None,
            seq: 0,
        }
    }

    /// Lets the machine go on for the time of a frame, and tells the pages.
    pub(super) fn turn(&mut self, frame: Duration) {
        self.source.advance(frame);
        while let Some((id, told)) = self.source.poll_told() {
            self.tell(id, &told);
        }
        self.tell_frame();
    }

    fn tell_frame(&mut self) {
        let frame = self.source.frame(self.seq);
        self.seq += 1;
        self.tell_all(&Told::Frame(Box::new(frame)));
    }

    /// A page whose queue is full takes nothing any more: it is dropped.
    fn tell_all(&mut self, told: &Told) {
        if self.clients.is_empty() {
            return;
        }
        let Some(text) = text_of(told) else { return };
        let mut gone = Vec::new();
        for (id, client) in &self.clients {
            if client.try_send(Arc::clone(&text)).is_err() {
                gone.push(*id);
            }
        }
        for id in gone {
            self.leave(id);
        }
    }

    fn tell(&mut self, id: ClientId, told: &Told) {
        let is_gone = match (self.clients.get(&id), text_of(told)) {
            (Some(client), Some(text)) => client.try_send(text).is_err(),
            _ => false,
        };
        if is_gone {
            self.leave(id);
        }
    }

    fn tell_control(&mut self) {
        let ids: Vec<_> = self.clients.keys().copied().collect();
        for id in ids {
            let told = Told::Control {
                yours: self.control == Some(id),
                taken: self.control.is_some(),
            };
            self.tell(id, &told);
        }
    }

    fn leave(&mut self, id: ClientId) {
        self.clients.remove(&id);
        if self.control == Some(id) {
            self.control = None;
            self.tell_control();
        }
    }

    pub(super) fn handle(&mut self, what: ToEngine) {
        match what {
            ToEngine::Joined(id, client) => {
                self.clients.insert(id, client);
                self.tell(id, &Told::Hello(Box::new(self.source.hello())));
                // Who is alone need not ask.
                if self.control.is_none() {
                    self.control = Some(id);
                }
                self.tell_control();
            }
            ToEngine::Left(id) => self.leave(id),
            ToEngine::Wants(id, order) => {
                let answer = if self.control == Some(id) || order.only_looks() {
                    self.obey(id, order)
                } else {
                    Err("another page has the control; take it over there, or wait until it is given up".to_owned())
                };
                let told = match answer {
                    Ok(None) => return,
                    Ok(Some(told)) => told,
                    Err(why) => Told::Refused { why },
                };
                self.tell(id, &told);
            }
        }
    }

    fn obey(&mut self, id: ClientId, order: Order) -> Result<Option<Told>, String> {
        match order {
            Order::TakeControl => {
                if self.control.is_some_and(|holder| holder != id) {
                    return Err("another page has the control; it must give it up first".to_owned());
                }
                self.control = Some(id);
                self.tell_control();
                Ok(None)
            }
            Order::ReleaseControl => {
                if self.control == Some(id) {
                    self.control = None;
                    self.tell_control();
                }
                Ok(None)
            }
            order => self.source.obey(id, order),
        }
    }
}

fn text_of(told: &Told) -> Option<Arc<str>> {
    serde_json::to_string(told).ok().map(Arc::from)
}
