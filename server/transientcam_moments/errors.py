"""What this package raises. A pixel's data never raises; only shapes and arguments do.

MomentsError
├── ShapeError (also a ValueError)
└── ParameterError (also a ValueError)
"""


class MomentsError(Exception):
    """Everything that this package raises on purpose.

    Catch it around any call::

        try:
            returns = tm.pisarenko(b)
        except tm.MomentsError as error:
            print(error)
    """


class ShapeError(MomentsError, ValueError):
    """An array has a shape or an element type that the function cannot take."""

    def __init__(self, name: str, found: object, expected: str) -> None:
        super().__init__(name, found, expected)
        self.name = name
        self.found = found
        self.expected = expected

    def __str__(self) -> str:
        """Name the array, what it is and what it has to be."""
        return f"{self.name} is {self.found}, expected {self.expected}"


class ParameterError(MomentsError, ValueError):
    """An argument lies outside of what the function is defined for."""

    def __init__(self, field: str, value: object, limit: str) -> None:
        super().__init__(field, value, limit)
        self.field = field
        self.value = value
        self.limit = limit

    def __str__(self) -> str:
        """Name the argument, its value and the limit."""
        return f"{self.field} = {self.value!r} is outside of its limit: {self.limit}"
