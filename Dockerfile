# VIGIL with everything its tests need.
#
#     docker build --tag vigil .
#     docker run --rm --shm-size 1g vigil                     # make test
#     docker run --rm --volume "$PWD/runs:/vigil/runs" vigil make run
#     docker run --rm --env OPENAI_API_KEY --volume "$PWD/runs:/vigil/runs" vigil .venv/bin/vigil run --model openai/gpt-4o --log-dir runs/gpt-4o
FROM debian:12-slim

# Debian's mirrors keep the newest version of a package alone, so that a pinned one soon could not be installed.
# hadolint ignore=DL3008
RUN apt-get update \
    && apt-get install --yes --no-install-recommends \
        ca-certificates chromium git libatomic1 libegl1 libgl1 make python3 python3-pip python3-venv \
    && rm -rf /var/lib/apt/lists/*

WORKDIR /vigil
COPY . .
RUN make setup-dev

CMD ["make", "test"]
