mod latest;
mod links;
