"""The application: routes, rights and errors put together."""

from http import HTTPMethod

from fastapi import Depends, FastAPI, Request
from fastapi.responses import JSONResponse, RedirectResponse
from starlette.exceptions import HTTPException
from starlette.routing import Match

from gudgeon.modaldb.records import SCHEMA_VERSION
from gudgeon.pipeline.service import files, motion, records, views
from gudgeon.pipeline.service.context import EXPLAINED, Service, explain, known_parameters, problem
from gudgeon.pipeline.service.door import KnownHost, SmallBodies
from gudgeon.pipeline.service.tree import add_tree

ABOUT = """Records of a modal database, and parts of their arrays. Every error is JSON with `error` and `detail`."""


def build_app(service: Service) -> FastAPI:
    """Return the application that serves some databases."""
    app = FastAPI(title="gudgeon modal database", version=str(SCHEMA_VERSION), description=ABOUT, docs_url=None,
                  redoc_url=None, dependencies=[Depends(known_parameters)])  # fmt: skip
    app.state.service, app.state.manifests = service, files.Manifests()
    for kind in EXPLAINED:
        app.add_exception_handler(kind, explain)
    app.add_exception_handler(HTTPException, _not_found)

    app.add_middleware(SmallBodies)
    app.add_middleware(KnownHost, hosts=service.hosts)  # The last is asked first.

    @app.get("/health")
    def health() -> dict[str, list[str] | int]:
        """Return the databases of this server and the schema version of its records."""
        return {"databases": list(service.stores), "schema_version": SCHEMA_VERSION,
                "token_needed": service.access.guarded}  # fmt: skip

    app.add_api_route("/", lambda: RedirectResponse("page/", 307), include_in_schema=False)
    app.mount("/page", views.Page(directory=views.PAGE, html=True))
    app.include_router(views.router)
    app.include_router(motion.router)
    app.include_router(records.router)
    app.include_router(files.router)
    add_tree(app)
    return app


async def _not_found(request: Request, error: Exception) -> JSONResponse:
    """Answer what no route is for."""
    assert isinstance(error, HTTPException)
    answer = problem(error.status_code, "StoreUnusable", f"{request.method} {request.url.path[:200]}: {error.detail}")
    answer.headers.update(error.headers or {})
    if error.status_code == 405 and not request.scope["root_path"]:  # The page's files name their methods themselves.
        methods = [method for method in HTTPMethod for route in request.app.routes
                   if route.matches({**request.scope, "method": method})[0] is Match.FULL]  # fmt: skip
        answer.headers["Allow"] = ", ".join(dict.fromkeys(methods))
    return answer
