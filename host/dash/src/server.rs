//! The server: HTTP and WebSocket over one source.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use axum::body::Body;
use axum::extract::ws::{Message, WebSocket, WebSocketUpgrade};
use axum::extract::{DefaultBodyLimit, Request, State};
use axum::http::header::{
    AUTHORIZATION, CACHE_CONTROL, CONTENT_SECURITY_POLICY, CONTENT_TYPE, HOST, ORIGIN,
    REFERRER_POLICY, X_CONTENT_TYPE_OPTIONS,
};
use axum::http::{HeaderMap, HeaderValue, Method, StatusCode};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use axum::{Json, Router};
use cathforce_recording::{Analysis, Recording};
use serde_json::{Value, json};
use tokio::sync::Semaphore;

use crate::answers::{Shown, Unanswered};
use crate::assets::ASSETS;
use crate::diagnosing::Diagnosing;
use crate::error::DashError;
use crate::foxglove::Bridge;
use crate::guard::{Guard, new_token};
use crate::live::{FollowSource, LinkSource, Pilot};
use crate::token_file;

/// Viewers at a time.
pub const MOST_VIEWERS: usize = 10;
/// Pictures that are on their way to a viewer: the next is sent when one has been drawn.
const ON_THE_WAY: u32 = 2;
/// From one look at the flag that ends the server to the next.
const LOOK: Duration = Duration::from_millis(50);
/// Longest request: settings.
const MOST_BYTES: usize = 64 << 10;
/// Only what this server sends may run or be loaded.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; \
                      img-src 'self' data: blob:; media-src 'self' blob:; connect-src 'self'; \
                      base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// What is shown.
pub enum Source {
    Link {
        name: String,
        source: Box<LinkSource>,
    },
    /// A device that another part of the program runs; it can be watched alone.
    Run {
        name: String,
        source: FollowSource,
    },
    Recording {
        name: String,
        recording: Box<Recording>,
        analysis: Box<Analysis>,
    },
    Diagnosis {
        name: String,
        answer: Value,
    },
    /// A diagnosis that another part of the program runs.
    Diagnosing {
        name: String,
        diagnosing: Diagnosing,
    },
}

/// How it is shown.
#[derive(Clone, Debug)]
pub struct Options {
    pub listen: SocketAddr,
    /// Names of this computer that browsers may use, besides `localhost`.
    pub names: Vec<String>,
    /// Folder for the file with the token.
    pub token_folder: PathBuf,
    /// Name and text of the page of each fault.
    pub fault_pages: Vec<(&'static str, &'static str)>,
    /// Where Foxglove is served; a diagnosis has nothing for it.
    pub foxglove: Option<SocketAddr>,
}

/// Where the server listens.
#[derive(Clone, Debug)]
pub struct Started {
    pub address: SocketAddr,
    /// For a link: the file that holds the token. Only its owner may read it.
    pub token_file: Option<PathBuf>,
    /// Where Foxglove is served.
    pub foxglove: Option<SocketAddr>,
}

struct Server {
    guard: Guard,
    shown: Shown,
    viewers: Arc<Semaphore>,
    faults: Value,
}

/// Serves until `stop` is set.
///
/// `on_start` is told the address once it listens; a link is opened before, by the caller.
pub fn serve(
    source: Source,
    options: Options,
    stop: &AtomicBool,
    on_start: impl FnOnce(&Started),
) -> Result<(), DashError> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    let runtime = runtime.map_err(DashError::Served)?;
    runtime.block_on(async {
        let failed = |source| DashError::Listen { listen: options.listen, source };
        let listener = tokio::net::TcpListener::bind(options.listen).await.map_err(failed)?;
        let address = listener.local_addr().map_err(failed)?;
        let (shown, bridge) = shown(source, options.foxglove).await?;
        let token = shown.source()["can_change"].as_bool().filter(|can| *can).map(|_| new_token());
        let token_file = token.as_ref().map(|token| TokenFile::write(&options, address, token));
        let token_file = token_file.transpose()?;
        let faults = options.fault_pages.iter().map(|(name, text)| (*name, json!(text)));
        let server = Arc::new(Server {
            guard: Guard::new(address, options.names.clone(), token),
            shown,
            viewers: Arc::new(Semaphore::new(MOST_VIEWERS)),
            faults: Value::Object(faults.map(|(name, text)| (name.to_owned(), text)).collect()),
        });
        on_start(&Started {
            address,
            token_file: token_file.as_ref().map(|file| file.0.clone()),
            foxglove: bridge.as_ref().map(Bridge::address),
        });
        let ended = async {
            while !stop.load(Ordering::Relaxed) {
                tokio::time::sleep(LOOK).await;
            }
        };
        let served = axum::serve(listener, router(server));
        // Open WebSockets do not keep the program from ending.
        tokio::select! {
            served = served => served.map_err(DashError::Served),
            () = ended => Ok(()),
        }
    })
}

/// Begins to show a source, to Foxglove too if that has an address.
async fn shown(
    source: Source,
    foxglove: Option<SocketAddr>,
) -> Result<(Shown, Option<Bridge>), DashError> {
    let live = async |name: &str, master| match foxglove {
        Some(listen) => {
            let (bridge, listener) = Bridge::live(listen, name, master).await?;
            Ok::<_, DashError>((Some(bridge), Some(listener)))
        }
        None => Ok((None, None)),
    };
    match source {
        Source::Link { name, source } => {
            let (bridge, listener) = live(&name, source.master).await?;
            let pilot = Pilot::start(*source, listener);
            Ok((Shown::Link { name, pilot, scene: Default::default() }, bridge))
        }
        Source::Run { name, source } => {
            let (bridge, listener) = live(&name, Default::default()).await?;
            let pilot = Pilot::follow(source, listener);
            Ok((Shown::Link { name, pilot, scene: Default::default() }, bridge))
        }
        Source::Recording { name, recording, analysis } => {
            let shown = Shown::of_recording(name.clone(), &recording, &analysis);
            let shown = shown.map_err(DashError::Vessel)?;
            let bridge = match foxglove {
                Some(listen) => Some(Bridge::replay(listen, &name, *recording).await?),
                None => None,
            };
            Ok((shown, bridge))
        }
        Source::Diagnosis { .. } | Source::Diagnosing { .. } if foxglove.is_some() => {
            Err(DashError::NothingForFoxglove)
        }
        Source::Diagnosing { name, diagnosing } => {
            Ok((Shown::Diagnosing { name, diagnosing }, None))
        }
        Source::Diagnosis { name, answer } => Ok((Shown::of_diagnosis(name, &answer), None)),
    }
}

/// The file with the token, deleted at the end.
struct TokenFile(PathBuf);

impl TokenFile {
    fn write(options: &Options, address: SocketAddr, token: &str) -> Result<Self, DashError> {
        use std::io::Write as _;
        token_file::remove_left(&options.token_folder);
        let path = options.token_folder.join(token_file::name(address.port()));
        let mut open = std::fs::OpenOptions::new();
        // Nobody may have put a file or a link there before.
        open.write(true).create_new(true);
        #[cfg(unix)]
        std::os::unix::fs::OpenOptionsExt::mode(&mut open, 0o600);
        let written = open.open(&path).and_then(|mut file| writeln!(file, "{token}"));
        match written {
            Ok(()) => Ok(Self(path)),
            Err(source) => Err(DashError::Token { path, source }),
        }
    }
}

impl Drop for TokenFile {
    fn drop(&mut self) {
        // A file that somebody has removed already is gone as well.
        let _ = std::fs::remove_file(&self.0);
    }
}

fn router(server: Arc<Server>) -> Router {
    let mut router = Router::new()
        .route("/api/state", get(async |State(s): Shared| Json(s.shown.state())))
        .route("/api/source", get(async |State(s): Shared| Json(s.shown.source())))
        .route("/api/faults", get(async |State(s): Shared| Json(s.faults.clone())))
        .route("/api/settings", get(async |State(s): Shared| s.shown.settings().map(Json)))
        .route("/api/tips", get(async |State(s): Shared| s.shown.tips().map(Json)))
        .route("/api/data", get(async |State(s): Shared| s.shown.data().map(json_text)))
        .route("/api/scene", get(scene))
        .route("/api/do", post(act))
        .route("/api/token", post(async || Json(json!({ "valid": true }))))
        .route("/ws", get(watch));
    for asset in ASSETS {
        let answer = ([(CONTENT_TYPE, asset.kind)], asset.bytes);
        router = router.route(asset.path, get(async move || answer));
    }
    router
        .layer(DefaultBodyLimit::max(MOST_BYTES))
        .layer(from_fn_with_state(Arc::clone(&server), check))
        .with_state(server)
}

type Shared = State<Arc<Server>>;

/// Refuses what does not come from a page of this server, and changes without the token.
async fn check(State(server): Shared, request: Request, next: Next) -> Response {
    let mut answer = match refusal(&server.guard, request.method(), request.headers()) {
        Some((status, why)) => error(status, why),
        None => next.run(request).await,
    };
    let headers = answer.headers_mut();
    headers.insert(CONTENT_SECURITY_POLICY, HeaderValue::from_static(POLICY));
    headers.insert(X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
    headers.insert(REFERRER_POLICY, HeaderValue::from_static("no-referrer"));
    headers.insert(CACHE_CONTROL, HeaderValue::from_static("no-store"));
    answer
}

fn refusal(
    guard: &Guard,
    method: &Method,
    headers: &HeaderMap,
) -> Option<(StatusCode, &'static str)> {
    let text = |name| headers.get(name).map(|value: &HeaderValue| value.to_str().unwrap_or("?"));
    let Some(host) = text(HOST).filter(|host| guard.is_host(host)) else {
        let why = "this server does not go by that name; open the address that it printed, or allow \
                   the name with --host";
        return Some((StatusCode::MISDIRECTED_REQUEST, why));
    };
    if !Guard::is_origin(text(ORIGIN), host) {
        return Some((StatusCode::FORBIDDEN, "pages of other origins may not ask here"));
    }
    let reads = matches!(*method, Method::GET | Method::HEAD);
    if !reads && !guard.may_change(text(AUTHORIZATION)) {
        let why = "changes need the token; it is in the file that was printed at the start";
        return Some((StatusCode::UNAUTHORIZED, why));
    }
    None
}

fn error(status: StatusCode, why: impl Into<String>) -> Response {
    (status, Json(json!({ "error": why.into() }))).into_response()
}

impl IntoResponse for Unanswered {
    fn into_response(self) -> Response {
        match self {
            Self::Absent(why) => error(StatusCode::NOT_FOUND, why),
            Self::Refused(why) => error(StatusCode::CONFLICT, why),
        }
    }
}

fn json_text(text: Arc<str>) -> Response {
    ([(CONTENT_TYPE, "application/json")], Body::from(text.to_string())).into_response()
}

/// A vessel's wall is computed beside the loop that serves the viewers.
async fn scene(State(server): Shared) -> Response {
    let made = tokio::task::spawn_blocking(move || server.shown.scene()).await;
    match made {
        Ok(made) => made.map(json_text).into_response(),
        Err(failed) => error(StatusCode::INTERNAL_SERVER_ERROR, failed.to_string()),
    }
}

async fn act(State(server): Shared, Json(asked): Json<Value>) -> Response {
    server.shown.act(&asked).await.map(Json).into_response()
}

/// A viewer of a link.
async fn watch(State(server): Shared, upgrade: WebSocketUpgrade) -> Response {
    let Ok(seat) = Arc::clone(&server.viewers).try_acquire_owned() else {
        let why = format!("{MOST_VIEWERS} viewers are here already; close one of them");
        return error(StatusCode::SERVICE_UNAVAILABLE, why);
    };
    upgrade.max_message_size(MOST_BYTES).on_upgrade(async move |socket| {
        // A viewer that has gone is no failure.
        let _ = show(socket, &server).await;
        drop(seat);
    })
}

/// Sends the newest picture whenever the viewer has drawn one; what it could not draw is never sent.
async fn show(mut socket: WebSocket, server: &Server) -> Result<(), axum::Error> {
    let Shown::Link { pilot, .. } = &server.shown else { return Ok(()) };
    let mut pictures = pilot.pictures.clone();
    pictures.mark_changed();
    let (mut on_the_way, mut is_over) = (0, false);
    loop {
        tokio::select! {
            changed = pictures.changed(), if !is_over && on_the_way < ON_THE_WAY => {
                if changed.is_err() {
                    // The link is lost: the last picture says why, and stays.
                    is_over = true;
                    continue;
                }
                let text = pictures.borrow_and_update().text.clone();
                if !text.is_empty() {
                    on_the_way += 1;
                    socket.send(Message::Text(text)).await?;
                }
            }
            message = socket.recv() => {
                let Some(message) = message.transpose()? else { return Ok(()) };
                let Message::Text(text) = message else { continue };
                // `drawn`, or the viewer's clock, which is answered with this one's.
                match text.strip_prefix("clock ") {
                    Some(theirs) => {
                        let own_ms = 1e3 * pilot.started.elapsed().as_secs_f64();
                        let answer = json!({ "clock": theirs, "server_ms": own_ms });
                        socket.send(Message::Text(answer.to_string().into())).await?;
                    }
                    None => on_the_way = on_the_way.saturating_sub(1),
                }
            }
        }
    }
}
