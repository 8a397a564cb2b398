"""Where the package may be imported."""


def require_main_interpreter():
    """Raises ImportError in a sub-interpreter."""
    try:
        import _interpreters as interpreters  # Python 3.13
    except ImportError:
        try:
            import _xxsubinterpreters as interpreters
        except ImportError:
            return  # a Python without any
    if interpreters.get_current() != interpreters.get_main():
        raise ImportError("gatefield is imported in a sub-interpreter, expected the main one: its network threads are "
                          "one set for the whole process; use threads, which run beside each other while they wait, or "
                          "processes")
