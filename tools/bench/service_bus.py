"""The service's documents over D-Bus, asked by this process itself: a start of `selfcal` for each question takes most of what a guest
with one processor has."""
import json
import os

import dbus
import dbus.bus

SERVICE, PATH = "org.selfcal.Manager1", "/org/selfcal/Manager"
PATIENCE_S = 180.0


class ServiceBus:
    """One connection, to the bus that `selfcal` would ask. dbus.DBusException: there is none."""

    def __init__(self):
        address = os.environ.get("SELFCAL_BUS")
        self.bus = dbus.bus.BusConnection(address or dbus.bus.BusConnection.TYPE_SYSTEM)
        self.bus.set_exit_on_disconnect(False)

    def close(self):
        self.bus.close()

    def has_service(self):
        return self.bus.name_has_owner(SERVICE)

    def document(self, run):
        """What `selfcal show RUN --json` prints; None where the service has none or is not there."""
        try:
            text = self.bus.call_blocking(SERVICE, PATH, SERVICE, "Show", "t", (run,), timeout=PATIENCE_S)
        except dbus.DBusException:
            return None
        return json.loads(text)
