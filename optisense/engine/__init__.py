"""The engine: a long-lived process that front ends talk to by lines of JSON.

The protocol is documented in docs/engine.md. `Engine` in `server` reads requests; each module
beside it handles some of them (`rendering`, `designing`, `library_requests`, `scoring`,
`searching`).
"""

from optisense.engine.protocol import PROTOCOL

__all__ = ["PROTOCOL"]
