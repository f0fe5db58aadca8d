"""Read-modify-writes from several processes, as a process of their own runs them."""

import sys

from sqlalchemy import text

from service.db.engine import write_engine


def main(url: str, times: int) -> None:
    engine = write_engine(url)
    for _ in range(times):
        with engine.begin() as connection:
            number = connection.execute(text("SELECT number FROM counter")).scalar_one()
            connection.execute(text("UPDATE counter SET number = :number"), {"number": number + 1})
    engine.dispose()


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
