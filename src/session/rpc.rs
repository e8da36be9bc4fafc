//! JSON-RPC 2.0, one object a line: the words of the control socket (documented in `docs/control-socket.md`).

use crate::model::finding::did_you_mean;
use serde::{Deserialize, Serialize};
use serde_json::{Value as Json, json};

/// A request or a notification (without `id`).
#[derive(Debug, Clone, Deserialize)]
pub struct RpcCall {
    /// `"2.0"`.
    #[serde(default)]
    pub jsonrpc: String,
    /// Echoed in the answer; none: no answer is wanted. `null` is an `id` as well.
    #[serde(default, deserialize_with = "given")]
    pub id: Option<Json>,
    /// What to do.
    pub method: String,
    /// With what.
    #[serde(default)]
    pub params: Json,
}

/// An error answer.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[error("{message}")]
pub struct RpcError {
    /// JSON-RPC's code, or one of ours (see the constants).
    pub code: i64,
    /// One sentence.
    pub message: String,
    /// More, as data.
    #[serde(default, skip_serializing_if = "Json::is_null")]
    pub data: Json,
}

/// The line is no JSON.
pub const PARSE_ERROR: i64 = -32700;
/// The line is no request.
pub const INVALID_REQUEST: i64 = -32600;
/// There is no such method.
pub const METHOD_NOT_FOUND: i64 = -32601;
/// The parameters do not fit the method.
pub const INVALID_PARAMS: i64 = -32602;
/// The deployment refused.
pub const REFUSED: i64 = 1;
/// The answer did not come in time.
pub const TIMED_OUT: i64 = 2;
/// The deployment is going down.
pub const GOING_DOWN: i64 = 3;
/// All places are taken.
pub const TOO_MANY: i64 = 4;

impl RpcError {
    /// An error without data.
    pub fn new(code: i64, message: impl Into<String>) -> Self {
        Self { code, message: message.into(), data: Json::Null }
    }

    /// An error with what to do about it.
    pub fn helped(code: i64, message: impl Into<String>, help: impl Into<String>) -> Self {
        Self { data: json!({ "help": help.into() }), ..Self::new(code, message) }
    }
}

fn given<'de, D: serde::Deserializer<'de>>(id: D) -> Result<Option<Json>, D::Error> {
    Json::deserialize(id).map(Some)
}

/// Reads one line as a call.
///
/// # Errors
/// The error answer to send, and the `id` to send it to as far as the line has one.
pub fn parse(line: &str) -> Result<RpcCall, (Json, RpcError)> {
    let json: Json = serde_json::from_str(line)
        .map_err(|e| (Json::Null, RpcError::new(PARSE_ERROR, format!("the line is not one JSON object: {e}"))))?;
    let id = json.get("id").filter(|id| id.is_string() || id.is_number()).cloned().unwrap_or(Json::Null);
    let refused = |message: String| (id.clone(), RpcError::new(INVALID_REQUEST, message));
    if json.is_array() {
        return Err(refused("batches are not supported: send one object a line".to_owned()));
    }
    let call: RpcCall = serde_json::from_value(json).map_err(|e| refused(format!("not a JSON-RPC request: {e}")))?;
    if call.jsonrpc != "2.0" {
        return Err(refused("`jsonrpc` must be \"2.0\"".to_owned()));
    }
    Ok(call)
}

/// The answer line to a call.
pub fn answer(id: &Json, result: Result<Json, RpcError>) -> String {
    match result {
        Ok(result) => json!({"jsonrpc": "2.0", "id": id, "result": result}),
        Err(error) => json!({"jsonrpc": "2.0", "id": id, "error": error}),
    }
    .to_string()
}

/// A notification line.
pub fn notification(method: &str, params: &Json) -> String {
    json!({"jsonrpc": "2.0", "method": method, "params": params}).to_string()
}

/// `params` holds nothing but these: a name that is misspelt would else be as if it were not there.
///
/// # Errors
/// It does, or it is no object.
pub fn only(method: &str, params: &Json, known: &[&str]) -> Result<(), RpcError> {
    let given = match params {
        Json::Null => return Ok(()),
        Json::Array(given) if given.is_empty() => return Ok(()),
        Json::Object(given) => given,
        _ => return Err(RpcError::new(INVALID_PARAMS, "`params` is an object: parameters are named")),
    };
    match given.keys().find(|name| !known.contains(&name.as_str())) {
        None => Ok(()),
        Some(name) => {
            let message = format!("`{method}` has no parameter `{name}`");
            Err(RpcError::helped(INVALID_PARAMS, message, did_you_mean(name, "parameters", known.iter().copied())))
        }
    }
}

/// A member of `params`, which must be an object or absent.
///
/// # Errors
/// When it is missing or of another type.
pub fn param<T: serde::de::DeserializeOwned>(params: &Json, name: &str) -> Result<T, RpcError> {
    optional(params, name)?.ok_or_else(|| RpcError::new(INVALID_PARAMS, format!("the parameter `{name}` is missing")))
}

/// A member of `params` that may be absent or null.
///
/// # Errors
/// When it is of another type.
pub fn optional<T: serde::de::DeserializeOwned>(params: &Json, name: &str) -> Result<Option<T>, RpcError> {
    match params.get(name) {
        None | Some(Json::Null) => Ok(None),
        Some(value) => serde_json::from_value(value.clone())
            .map(Some)
            .map_err(|e| RpcError::new(INVALID_PARAMS, format!("the parameter `{name}`: {e}"))),
    }
}
