"""What holds for all tests."""

import signal


def pytest_configure() -> None:
    """Let the programs that tests start be interrupted, also where the tests run behind `&`.

    A shell makes its background jobs ignore Ctrl-C, and what they start inherits that.
    """
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
