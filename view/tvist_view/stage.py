"""The page's server with its floor, lights and camera. It is reached from this machine alone, unless told otherwise."""

import contextlib
import io
import ipaddress
import socket
from urllib.parse import urlsplit

from viser import ClientHandle, ViserServer
from viser._messages import ShareUrlRequest
from viser.infra import WebsockClientConnection

UPRIGHT = 0.8
"""Width over height below which a window is a phone's [-]."""
PHONE_DISTANCE, PHONE_DROP = 1.4, 0.72
"""How much further a phone's camera is, and how far below the point it looks, in distances [-]."""


class StageError(RuntimeError):
    """The page cannot be served."""


def open_stage(address: str, port: int, title: str, *, insecure: bool = False) -> ViserServer:
    """Serve a page.

    Args:
        address: Address to listen on.
        port: Port to listen on; 0 takes a free one.
        title: Title of the page.
        insecure: Serve other machines, too: whoever opens the page can move the robot.

    Raises:
        StageError: The port is in use, the address is not this machine's, or other machines could reach it.
    """
    if not _is_local(address) and not insecure:
        raise StageError(
            f"address is {address}: other machines could open the page and move the robot, since it knows no "
            "passwords. Add --insecure to accept that, or forward the port: ssh -L 8080:127.0.0.1:8080 HOST"
        )
    with socket.socket(socket.AF_INET6 if ":" in address else socket.AF_INET) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((address, port))
        except (OSError, OverflowError) as error:
            raise StageError(
                f"cannot listen on {address} port {port}: {getattr(error, 'strerror', None) or error}. "
                "Another port: --port 8081"
            ) from error
        port = probe.getsockname()[1]
    with contextlib.redirect_stdout(
        io.StringIO()
    ):  # it would print a banner; the caller says where the page is
        server = ViserServer(host=address, port=port, label=title, verbose=False)
    _only_this_site(server, anywhere=insecure)
    server.gui.configure_theme(
        control_layout="floating",
        control_width="medium",
        show_logo=False,
        show_share_button=False,
    )
    server.gui.set_panel_label(title)
    scene = server.scene
    scene.set_up_direction("+z")
    scene.configure_environment_map(None)
    scene.add_light_ambient("/lights/ambient", intensity=1.2)
    scene.add_light_directional("/lights/sun", intensity=2.2, position=(1.5, -2.0, 3.0), cast_shadow=True)
    scene.add_light_directional("/lights/sky", intensity=1.0, position=(-2.0, 1.5, 2.0))
    scene.add_grid("/floor", 4.0, 4.0, cell_size=0.25, section_size=1.0, shadow_opacity=0.25)
    return server


def _only_this_site(server: ViserServer, *, anywhere: bool) -> None:
    """Turn away other web sites in this machine's browsers, and requests for a public tunnel to the page.

    A browser lets any site open a WebSocket to this machine, and names the site in the header Origin.
    """
    sockets = server._websock_server  # noqa: SLF001  viser has no public way to do either
    sockets.unregister_handler(ShareUrlRequest)

    async def check(client: WebsockClientConnection) -> None:
        connection = sockets._live_connections[client.client_id]  # noqa: SLF001
        if connection.request is None:
            return
        origin, host = (connection.request.headers.get(name) for name in ("Origin", "Host"))
        if origin is None:  # no browser
            return
        site = urlsplit(origin)
        if site.netloc != host or not (anywhere or _is_local(site.hostname or "")):
            await connection.close(1008, "another site")

    sockets.on_client_connect(check)


def is_watched(server: ViserServer) -> bool:
    """Whether anybody is connected to the page, also one who draws nothing."""
    return bool(server._websock_server._live_connections)  # noqa: SLF001  viser counts only those with a camera


def close_stage(server: ViserServer) -> None:
    """End the page."""
    with contextlib.redirect_stdout(io.StringIO()):
        server.stop()


def look_at(server: ViserServer, target: tuple[float, float, float], distance: float) -> None:
    """Have every camera begin with a look at a point [m] from the front and above.

    On a phone held upright the controls cover the lower half: the point is above the middle then, and further away.
    """

    def aim(client: ClientHandle) -> None:
        if client.camera.aspect < UPRIGHT:
            x, y, z = target
            client.camera.position = _from(target, PHONE_DISTANCE * distance)
            client.camera.look_at = (x, y, z - PHONE_DROP * distance)

    server.initial_camera.look_at = target
    server.initial_camera.position = _from(target, distance)
    server.on_client_connect(aim)


def _from(target: tuple[float, float, float], distance: float) -> tuple[float, float, float]:
    return (target[0] + 0.75 * distance, target[1] - 0.95 * distance, target[2] + 0.45 * distance)


def _is_local(address: str) -> bool:
    try:
        return ipaddress.ip_address(address).is_loopback
    except ValueError:
        return address == "localhost"
