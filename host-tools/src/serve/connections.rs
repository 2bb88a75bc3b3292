//! Connections of the page's server: only so many at a time, and none that does not say what it wants.

use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::net::TcpListener;
use tokio::sync::Semaphore;

/// How long a request may take to be said.
const PATIENCE: Duration = Duration::from_secs(10);
/// Connections at a time: some ten tabs have six each.
const MOST: usize = 64;
/// Pause when the system has no room for another connection.
const BREATH: Duration = Duration::from_millis(50);

/// Answers connections for ever.
pub async fn answer(listener: TcpListener, router: Router) -> std::convert::Infallible {
    let room = Arc::new(Semaphore::new(MOST));
    loop {
        let Ok(place) = Arc::clone(&room).acquire_owned().await else {
            unreachable!("nobody closes it");
        };
        let Ok((connection, _)) = listener.accept().await else {
            tokio::time::sleep(BREATH).await;
            continue;
        };
        let service = TowerToHyperService::new(router.clone());
        tokio::spawn(async move {
            let mut http = http1::Builder::new();
            http.timer(TokioTimer::new()).header_read_timeout(PATIENCE);
            // Whatever ends it concerns whoever has opened it, and nobody else.
            let _ = http.serve_connection(TokioIo::new(connection), service).await;
            drop(place);
        });
    }
}
