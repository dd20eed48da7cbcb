#!/usr/bin/env python3
"""Negative control of style.py: statements without braces are found, and nothing else is."""
import unittest

import style

BRACED = """
if (a) {
} else if (b) {
} else {
}
for (const char* text : {R"(if (x) y;
  while (z) w;)"}) {
}
do {
} while (a && (b || c));
if (const auto x = f(1, ")");
    x > 0) {
}
int format = 1;  // if (a) b;
"""
BARE = {
    "if": "if (a) return;",
    "if over lines": "if (a &&\n    b)\n  return;",
    "else": "if (a) {\n} else return;",
    "else over lines": "if (a) {\n} else\n  return;",
    "for": "for (int i = 0; i < 3; ++i) f(i);",
    "while": "while (f()) g();",
    "if constexpr": "if constexpr (a) f();",
}


class Braces(unittest.TestCase):
    def test_braced_code_is_left_alone(self):
        self.assertEqual(list(style.unbraced(BRACED)), [])

    def test_each_bare_statement_is_found(self):
        for name, code in BARE.items():
            with self.subTest(name):
                self.assertEqual(len(list(style.unbraced(code))), 1)


if __name__ == "__main__":
    unittest.main()
