//! HTTP and WebSocket: the page, and one live connection for each page.

use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use axum::Router;
use axum::extract::ws::{CloseFrame, Message, WebSocket, WebSocketUpgrade};
use axum::extract::{Query, State};
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use futures_util::{SinkExt, StreamExt};
use serde::Deserialize;
use tokio::net::TcpListener;
use tokio::sync::{Semaphore, mpsc};
use tokio::time::timeout;

use super::access::{Access, AccessRefused, PanelError};
use super::engine::{Engine, QUEUE, ToEngine};
use super::protocol::{MAX_CLIENTS, MAX_ORDER, MAX_ORDERS_PER_S, Order};
use crate::operator::FeedPlan;
use crate::real_line::RealLine;
use crate::rig::RigConfig;

/// What a panel is made of.
#[derive(Debug, Clone)]
pub struct Panel {
    /// Who may come.
    pub access: Access,
    /// What is behind it.
    pub machine: Machine,
}

/// What a panel shows.
#[derive(Debug, Clone)]
pub enum Machine {
    /// The whole chain in virtual time.
    Simulated {
        /// The chain.
        rig: Box<RigConfig>,
        /// What the inputs of the block are filled in with.
        plan: FeedPlan,
    },
    /// Block and master on a line, in real time.
    Real(RealLine),
}

#[derive(Debug)]
struct Shared {
    access: Access,
    engine: Engine,
    /// A place for each page that may be connected.
    places: Arc<Semaphore>,
    next: AtomicU64,
}

/// Serves the panel until the process ends; `ready` is told where it listens.
///
/// # Errors
///
/// [`PanelError`].
pub fn serve(panel: Panel, ready: impl FnOnce(SocketAddr)) -> Result<(), PanelError> {
    let engine = match panel.machine {
        Machine::Simulated { rig, plan } => Engine::start(*rig, &plan)?,
        Machine::Real(line) => Engine::start_on(&line).map_err(PanelError::Line)?,
    };
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
        .map_err(PanelError::Server)?;
    runtime.block_on(async move {
        let listen = panel.access.listen();
        let failed = |source| PanelError::Listen { listen, source };
        let listener = TcpListener::bind(listen).await.map_err(failed)?;
        let at = listener.local_addr().map_err(failed)?;
        let shared = Arc::new(Shared {
            access: panel.access.at(at),
            engine,
            places: Arc::new(Semaphore::new(MAX_CLIENTS)),
            next: AtomicU64::new(1),
        });
        let mut router = Router::new()
            .route("/live", get(live))
            .route("/capture.pcapng", get(capture));
        for (path, kind, text) in ASSETS {
            let asset = move |State(shared): State<Arc<Shared>>, headers: HeaderMap| async move {
                asset(&shared, &headers, kind, text)
            };
            router = router.route(path, get(asset));
        }
        ready(at);
        axum::serve(listener, router.with_state(shared))
            .await
            .map_err(PanelError::Server)
    })
}

const ASSETS: [(&str, &str, &str); 12] = [
    ("/", "text/html; charset=utf-8", include_str!("assets/index.html")),
    (
        "/style.css",
        "text/css; charset=utf-8",
        include_str!("assets/style.css"),
    ),
    ("/app.js", JS, include_str!("assets/app.js")),
    ("/words.js", JS, include_str!("assets/words.js")),
    ("/german.js", JS, include_str!("assets/german.js")),
    ("/dom.js", JS, include_str!("assets/dom.js")),
    ("/machine.js", JS, include_str!("assets/machine.js")),
    ("/variables.js", JS, include_str!("assets/variables.js")),
    ("/scope.js", JS, include_str!("assets/scope.js")),
    ("/drive.js", JS, include_str!("assets/drive.js")),
    ("/parameters.js", JS, include_str!("assets/parameters.js")),
    ("/bus.js", JS, include_str!("assets/bus.js")),
];
const JS: &str = "text/javascript; charset=utf-8";

/// Nothing from elsewhere, no frames around us, no guessing of types.
const POLICY: &str = "default-src 'self'; img-src 'self' data: blob:; style-src 'self'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'";

fn asset(shared: &Shared, headers: &HeaderMap, kind: &'static str, text: &'static str) -> Response {
    if let Err(refused) = shared.access.check_host(text_of(headers, header::HOST)) {
        return turned_away(refused);
    }
    let fixed = |value: &'static str| HeaderValue::from_static(value);
    (
        [
            (header::CONTENT_TYPE, fixed(kind)),
            (header::CONTENT_SECURITY_POLICY, fixed(POLICY)),
            (header::X_CONTENT_TYPE_OPTIONS, fixed("nosniff")),
            (header::REFERRER_POLICY, fixed("no-referrer")),
            (header::CACHE_CONTROL, fixed("no-cache")),
        ],
        text,
    )
        .into_response()
}

fn text_of(headers: &HeaderMap, name: header::HeaderName) -> Option<&str> {
    headers.get(name).and_then(|value| value.to_str().ok())
}

fn turned_away(refused: AccessRefused) -> Response {
    let status = match refused {
        AccessRefused::TooMany => StatusCode::SERVICE_UNAVAILABLE,
        AccessRefused::Host | AccessRefused::Origin | AccessRefused::Token => StatusCode::FORBIDDEN,
    };
    (status, format!("{refused}\n")).into_response()
}

#[derive(Debug, Deserialize)]
struct LiveQuery {
    token: Option<String>,
}

/// The last telegrams, for Wireshark and `dp sniff --read`.
async fn capture(State(shared): State<Arc<Shared>>, Query(query): Query<LiveQuery>, headers: HeaderMap) -> Response {
    let (host, origin) = (text_of(&headers, header::HOST), text_of(&headers, header::ORIGIN));
    if let Err(refused) = shared.access.check(host, origin, query.token.as_deref()) {
        return turned_away(refused);
    }
    match shared.engine.capture.file() {
        Ok(octets) => {
            let fixed = |value: &'static str| HeaderValue::from_static(value);
            let headers = [
                (header::CONTENT_TYPE, fixed("application/octet-stream")),
                (
                    header::CONTENT_DISPOSITION,
                    fixed("attachment; filename=\"capture.pcapng\""),
                ),
                (header::X_CONTENT_TYPE_OPTIONS, fixed("nosniff")),
            ];
            (headers, octets).into_response()
        }
        Err(error) => (StatusCode::INTERNAL_SERVER_ERROR, format!("{error}\n")).into_response(),
    }
}

async fn live(
    State(shared): State<Arc<Shared>>,
    Query(query): Query<LiveQuery>,
    headers: HeaderMap,
    upgrade: WebSocketUpgrade,
) -> Response {
    let (host, origin) = (text_of(&headers, header::HOST), text_of(&headers, header::ORIGIN));
    if let Err(refused) = shared.access.check(host, origin, query.token.as_deref()) {
        return turned_away(refused);
    }
    // Taken before the answer: of pages that come at the same moment none gets a place too many.
    let Ok(place) = Arc::clone(&shared.places).try_acquire_owned() else {
        return turned_away(AccessRefused::TooMany);
    };
    upgrade
        .max_message_size(MAX_ORDER)
        .max_frame_size(MAX_ORDER)
        .on_upgrade(move |socket| async move {
            talk(socket, &shared).await;
            drop(place);
        })
}

/// How long a page may take for one message before it counts as gone.
const PATIENCE: Duration = Duration::from_secs(5);

/// Carries orders in and frames out until one side ends.
async fn talk(socket: WebSocket, shared: &Shared) {
    let id = shared.next.fetch_add(1, Ordering::Relaxed);
    let (to_page, mut for_page) = mpsc::channel::<Arc<str>>(QUEUE);
    if !shared.engine.send(ToEngine::Joined(id, to_page)) {
        return;
    }
    let (mut out, mut incoming) = socket.split();
    let mut second = Instant::now();
    let mut orders = 0;
    let farewell = loop {
        tokio::select! {
            told = for_page.recv() => {
                // The engine has dropped us: we were too slow.
                let Some(told) = told else {
                    break Some((1008, "this page takes its frames too slowly; reload it"));
                };
                let message = Message::Text(told.as_ref().into());
                match timeout(PATIENCE, out.send(message)).await {
                    Ok(Ok(())) => {}
                    _ => break None,
                }
            }
            message = incoming.next() => {
                let message = match message {
                    Some(Ok(Message::Close(_)) | Err(_)) | None => break None,
                    Some(Ok(message)) => message,
                };
                // A ping is answered, so that it costs as much as an order.
                if second.elapsed() > Duration::from_secs(1) {
                    second = Instant::now();
                    orders = 0;
                }
                orders += 1;
                if orders > MAX_ORDERS_PER_S {
                    break Some((1008, "too many orders in a second"));
                }
                let text = match message {
                    Message::Text(text) => text,
                    Message::Binary(_) => break Some((1003, "orders are texts")),
                    _ => continue,
                };
                let Ok(order) = serde_json::from_str::<Order>(&text) else {
                    break Some((1007, "that is no order"));
                };
                if !shared.engine.send(ToEngine::Wants(id, order)) {
                    break Some((1011, "the engine has ended"));
                }
            }
        }
    };
    shared.engine.send(ToEngine::Left(id));
    if let Some((code, reason)) = farewell {
        let close = Message::Close(Some(CloseFrame {
            code,
            reason: reason.into(),
        }));
        // It may be gone already.
        let _ = timeout(PATIENCE, out.send(close)).await;
    }
}
