# Sourced by the scripts here: runs gnpd on a free loopback port for as long as the script lives.
#
#   daemon_start BUILD FOLDER   sets $url once the daemon is ready; its log is FOLDER/gnpd.log
# The daemon is stopped by its process id when the script ends, however it ends.

daemon=
daemon_stop() {
	[ -n "$daemon" ] || return 0
	kill "$daemon" 2>/dev/null || true
	wait "$daemon" 2>/dev/null || true
	rm -f "$port_file"
	daemon=
}
trap daemon_stop EXIT
trap 'exit 130' INT
trap 'exit 143' TERM HUP

daemon_start() {
	port_file=$2/port
	rm -f "$port_file"
	weights_dir=weights
	[ -d weights ] || weights_dir=
	"$1/gnpd" --listen 127.0.0.1:0 --port-file "$port_file" ${weights_dir:+--weights-dir "$weights_dir"} >"$2/gnpd.log" 2>&1 &
	daemon=$!
	tries=0
	until [ -s "$port_file" ] && url=http://127.0.0.1:$(cat "$port_file") && curl -sf -o "$2/ready.json" "$url/v2/health/ready"; do
		tries=$((tries + 1))
		if [ "$tries" -gt 100 ] || ! kill -0 "$daemon" 2>/dev/null; then
			echo "gnpd did not become ready; its log ($2/gnpd.log):" >&2
			tail -n 20 "$2/gnpd.log" >&2
			exit 1
		fi
		sleep 0.1
	done
	rm -f "$2/ready.json"
}

# estimate IN.ply OUT.ply [PARAMETERS]: sends a cloud with curl; sets $seconds (curl's total). PARAMETERS: name=value&...
estimate() {
	seconds=$(curl --silent --show-error --data-binary @"$1" -H 'Content-Type: application/ply' -H 'Accept: application/ply' \
		-H 'Expect:' --output "$2.part" --write-out '%{http_code} %{time_total}' "$url/v1/estimate?${3-}")
	case $seconds in
	200\ *) seconds=${seconds#* }; mv "$2.part" "$2" ;;
	*)
		echo "gnpd answered HTTP ${seconds%% *}: $(head -c 500 "$2.part")" >&2
		rm -f "$2.part"
		exit 1 ;;
	esac
}

# comment FILE.ply NAME: the value of a comment line of the header; empty when there is none.
comment() {
	sed -n "/^end_header/q;s/^comment \(gnpd \)\{0,1\}$2 //p" "$1" | tr -d '\r'
}

# print_seconds FILE.ply: where the time of the last estimate went. Transfer is curl's total less the server's stages.
print_seconds() {
	orient=$(comment "$1" seconds_orient) neighbors=$(comment "$1" seconds_neighbors)
	order=$(comment "$1" seconds_order) survey=$(comment "$1" seconds_prepare) work=$(comment "$1" seconds_estimate)
	awk -v t="$seconds" -v o="${orient:-0}" -v n="${neighbors:-0}" -v r="${order:-0}" -v p="${survey:-0}" -v w="${work:-0}" 'BEGIN {
		printf "%-34s %9s\n", "stage", "seconds"
		printf "%-34s %9.3f\n", "transfer, decoding and encoding", t - o - n - r - p - w
		printf "%-34s %9.3f\n", "order", r
		printf "%-34s %9.3f\n", "neighbours", n
		printf "%-34s %9.3f\n", "orientation", o
		printf "%-34s %9.3f\n", "noise, outliers, sheets", p
		printf "%-34s %9.3f\n", "estimate", w
		printf "%-34s %9.3f\n", "total, as curl measured it", t }'
}
