#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Makes what `--security DIR` of every service needs: two certificate authorities, a key and a
# certificate for each service, the governance of the domain and each service's permissions. Nothing
# of it belongs in a repository. deploy/security/README.md tells how it is used.
set -euo pipefail
umask 077

readonly program=make_certificates.sh
readonly usage="usage: $program [--days N] [--ca-days N] [--domains MIN-MAX] [--only SERVICE] DIR"

fail() {
  echo "$program: $*" >&2
  exit 2
}

# Who writes and reads what: the one place that says so. A topic that isn't named is refused, and a
# topic of common/dds/topics.h that nobody writes or reads here fails a test.
readonly services="gyro_publisher thermal_publisher compensation allan_monitor console navigation_filter zerodrift"
readonly of_all="service_status event" # written and read by every service
writes() {
  case $1 in
    gyro_publisher) echo angular_rate rate_reference temperature command_reply ;; # a serial gyro has a thermometer
    thermal_publisher) echo temperature environment replay_progress ;;
    compensation) echo compensated_rate thermal_coverage command_reply replay_progress checkpoint 'rt/*' ;; # --ros2-imu
    allan_monitor) echo allan_report replay_progress ;;
    console) echo command ;;
    navigation_filter) echo navigation rate_reference replay_progress ;;
    zerodrift) echo angular_rate temperature environment rate_reference command replay_progress twin_report ;; # replay, ctl, record, diagnose
  esac
}
reads() {
  case $1 in
    gyro_publisher) echo replay_progress command 'rt/*' ;; # inject, replay; --source ros2:
    thermal_publisher) echo replay_progress 'rt/*' ;; # --source ros2:
    compensation) echo angular_rate temperature rate_reference compensated_rate command checkpoint replay_progress ;; # a standby follows the primary
    allan_monitor) echo compensated_rate ;;
    navigation_filter) echo compensated_rate rate_reference ;;
    console) echo temperature rate_reference compensated_rate thermal_coverage allan_report command_reply navigation twin_report ;;
    zerodrift) echo angular_rate temperature environment rate_reference compensated_rate allan_report command command_reply replay_progress checkpoint navigation twin_report thermal_coverage ;; # record takes all
  esac
}

days=365
ca_days=3650
domains=0-232
are_domains_given=
only=
folder=
is_number() { [[ $1 =~ ^[1-9][0-9]{0,4}$ ]]; }
while (($#)); do
  case $1 in
    --help)
      echo "$usage"
      exit 0
      ;;
    --days | --ca-days | --domains | --only)
      (($# > 1)) || fail "$1 needs a value; $usage"
      case $1 in
        --days) days=$2 ;;
        --ca-days) ca_days=$2 ;;
        --domains) domains=$2 are_domains_given=1 ;;
        --only) only=$2 ;;
      esac
      shift 2
      ;;
    -*) fail "unknown option $1; $usage" ;;
    *)
      [[ -z $folder ]] || fail "one folder expected, found '$folder' and '$1'; $usage"
      folder=$1
      shift
      ;;
  esac
done
[[ -n $folder ]] || fail "no folder given; $usage"
is_number "$days" || fail "--days: found '$days', expected 1..99999"
is_number "$ca_days" || fail "--ca-days: found '$ca_days', expected 1..99999"
[[ $domains =~ ^(0|[1-9][0-9]{0,2})-(0|[1-9][0-9]{0,2})$ ]] && ((BASH_REMATCH[1] <= BASH_REMATCH[2] && BASH_REMATCH[2] <= 232)) ||
  fail "--domains: found '$domains', expected MIN-MAX within 0-232, e.g. 0-232"
domain_set="<domains><id_range><min>${domains%-*}</min><max>${domains#*-}</max></id_range></domains>"
[[ -z $only || " $services " == *" $only "* ]] || fail "--only: no service '$only'; one of: $services"
command -v openssl >/dev/null || fail "openssl is not installed"

scratch=
trap '[[ -z $scratch ]] || rm -rf "$scratch"' EXIT

# OpenSSL's own words only where it fails.
quietly() {
  local words
  words=$("$@" 2>&1) || fail "$1 $2: $(tail -n 1 <<<"$words")"
}

new_key() { quietly openssl genpkey -algorithm EC -pkeyopt ec_paramgen_curve:P-256 -out "$1"; }

# Everything counts from a day ago, so that clocks that differ a little and time zones do no harm.
readonly begin="-1 day"
# at WHEN FORMAT
at() { date -u -d "$1" "+$2"; }

# certify NAME_OF_OUT KEY SUBJECT DAYS EXTENSIONS [option of openssl ca ...]: of what can say when a certificate begins,
# Debian 12 has `openssl ca` alone, which keeps a book.
certify() {
  local out=$1 key=$2 subject=$3 days=$4 extensions=$5
  shift 5
  local book
  book=$(mktemp -d ./book.XXXXXX)
  : >"$book/index"
  cat >"$book/config" <<CONFIG
[ca]
default_ca = own
[own]
database = $book/index
new_certs_dir = $book
rand_serial = yes
default_md = sha256
policy = subject
preserve = yes
unique_subject = no
[subject]
organizationName = supplied
commonName = supplied
CONFIG
  printf '%b' "$extensions" >"$book/extensions"
  quietly openssl req -new -sha256 -key "$key" -subj "$subject" -out "$book/request"
  quietly openssl ca -batch -notext -config "$book/config" -in "$book/request" -out "$out" \
    -startdate "$(at "$begin" %Y%m%d%H%M%SZ)" -enddate "$(at "+$days days" %Y%m%d%H%M%SZ)" \
    -extfile "$book/extensions" "$@"
  chmod 644 "$out"
  rm -r "$book"
}

# authority NAME: ca/NAME.key and NAME.pem. It signs certificates and, as S/MIME, documents.
authority() {
  new_key "ca/$1.key"
  certify "$1.pem" "ca/$1.key" "/O=zerodrift/CN=$1" "$ca_days" \
    'basicConstraints=critical,CA:TRUE\nkeyUsage=critical,keyCertSign,cRLSign,digitalSignature\nsubjectKeyIdentifier=hash\n' \
    -selfsign -keyfile "ca/$1.key"
}

# sign_document FILE OUT: signed by the permissions authority, in the form that DDS Security wants.
sign_document() {
  quietly openssl smime -sign -text -in "$1" -out "$2" -signer "$3/permissions_ca.pem" -inkey "$3/ca/permissions_ca.key"
  chmod 644 "$2"
  rm "$1"
}

# Everything is encrypted: whole messages by the key of the participant, submessages and payloads by
# the key of the writer, which only readers of its topic get.
governance() {
  cat <<XML
<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:noNamespaceSchemaLocation="http://www.omg.org/spec/DDS-Security/20170801/omg_shared_ca_domain_governance.xsd">
  <domain_access_rules>
    <domain_rule>
      $domain_set
      <allow_unauthenticated_participants>false</allow_unauthenticated_participants>
      <enable_join_access_control>true</enable_join_access_control>
      <discovery_protection_kind>ENCRYPT</discovery_protection_kind>
      <liveliness_protection_kind>ENCRYPT</liveliness_protection_kind>
      <rtps_protection_kind>ENCRYPT</rtps_protection_kind>
      <topic_access_rules>
        <topic_rule>
          <topic_expression>*</topic_expression>
          <enable_discovery_protection>true</enable_discovery_protection>
          <enable_liveliness_protection>true</enable_liveliness_protection>
          <enable_read_access_control>true</enable_read_access_control>
          <enable_write_access_control>true</enable_write_access_control>
          <metadata_protection_kind>ENCRYPT</metadata_protection_kind>
          <data_protection_kind>ENCRYPT</data_protection_kind>
        </topic_rule>
      </topic_access_rules>
    </domain_rule>
  </domain_access_rules>
</dds>
XML
}

topics() {
  local topic
  echo "<topics>"
  for topic in "$@"; do echo "            <topic>$topic</topic>"; done
  echo "          </topics>"
}

# Without it: the partition of those that name none. Instances that stand by for each other have one each.
partitions() {
  [[ $1 != compensation ]] || echo "<partitions><partition>*</partition></partitions>"
}

permissions() {
  # shellcheck disable=SC2046  # one word a topic
  cat <<XML
<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:noNamespaceSchemaLocation="http://www.omg.org/spec/DDS-Security/20170801/omg_shared_ca_permissions.xsd">
  <permissions>
    <grant name="$1">
      <subject_name>CN=$1,O=zerodrift</subject_name>
      <validity>
        <not_before>$(at "$begin" %Y-%m-%dT%H:%M:%S)</not_before>
        <not_after>$(at "+$days days" %Y-%m-%dT%H:%M:%S)</not_after>
      </validity>
      <allow_rule>
        $domain_set
        <publish>
          $(topics $(writes "$1") $of_all)
          $(partitions "$1")
        </publish>
        <subscribe>
          $(topics $(reads "$1") $of_all)
          $(partitions "$1")
        </subscribe>
      </allow_rule>
      <default>DENY</default>
    </grant>
  </permissions>
</dds>
XML
}

# service NAME AUTHORITIES: key, certificate and permissions in ./NAME.
service() {
  local name=$1 authorities=$2
  mkdir "$name"
  chmod 755 "$name"
  new_key "$name/key.pem"
  certify "$name/certificate.pem" "$name/key.pem" "/O=zerodrift/CN=$name" "$days" \
    'basicConstraints=critical,CA:FALSE\nkeyUsage=critical,digitalSignature\n' \
    -cert "$authorities/identity_ca.pem" -keyfile "$authorities/ca/identity_ca.key"
  permissions "$name" >"$name/permissions.xml"
  sign_document "$name/permissions.xml" "$name/permissions.p7s" "$authorities"
}

# outlives FILE: nobody believes a certificate longer than who signed it.
outlives() {
  openssl x509 -in "$1" -noout -checkend "$((86400 * days))" >/dev/null ||
    fail "--days: found '$days', but $1 ends before that: expected fewer days, or a new folder"
}

make_all() {
  ((days <= ca_days)) || fail "--days: found '$days', expected at most --ca-days, $ca_days"
  [[ ! -e $folder ]] || fail "$folder exists; a new folder is expected, or --only SERVICE to renew one certificate"
  local parent
  parent=$(dirname -- "$folder")
  [[ -d $parent && -w $parent ]] || fail "cannot write to $parent"
  scratch=$(mktemp -d "$parent/.$program.XXXXXX")
  (
    cd "$scratch"
    mkdir ca
    authority identity_ca
    authority permissions_ca
    governance >governance.xml
    sign_document governance.xml governance.p7s .
    for name in $services; do service "$name" .; done
  )
  chmod 755 "$scratch"
  mv -T -- "$scratch" "$folder"
  scratch=
  echo "$folder: authorities in ca/ (keep them elsewhere), $(wc -w <<<"$services") services, valid for $days days"
}

# The <domains> of a governance that is in force.
domains_of() {
  local document
  document=$(openssl smime -verify -in "$1" -CAfile "$2" 2>/dev/null) && [[ $document == *"<domains>"*"</domains>"* ]] ||
    fail "$1 names no domains, or is not signed by $2; --domains MIN-MAX says which are meant"
  document=${document//$'\r'/}
  document=${document#*<domains>}
  echo "<domains>${document%%</domains>*}</domains>"
}

renew_one() {
  local file
  for file in ca/identity_ca.key identity_ca.pem ca/permissions_ca.key permissions_ca.pem; do
    [[ -r $folder/$file ]] || fail "$folder/$file is missing; renewing needs the authorities' keys"
  done
  outlives "$folder/identity_ca.pem"
  outlives "$folder/permissions_ca.pem"
  [[ $are_domains_given ]] || domain_set=$(domains_of "$folder/governance.p7s" "$folder/permissions_ca.pem")
  local authorities
  authorities=$(cd -- "$folder" && pwd)
  scratch=$(mktemp -d "$authorities/.$program.XXXXXX")
  (
    cd "$scratch"
    service "$only" "$authorities"
  )
  if [[ -e $authorities/$only ]]; then
    chown -R --reference="$authorities/$only" "$scratch/$only" # its service reads it
    mv -T -- "$authorities/$only" "$scratch/old"
  fi
  mv -T -- "$scratch/$only" "$authorities/$only" || {
    [[ ! -e $scratch/old ]] || mv -T -- "$scratch/old" "$authorities/$only"
    fail "cannot write to $authorities/$only; what was there is kept"
  }
  echo "$folder/$only: renewed, valid for $days days"
}

if [[ -n $only ]]; then renew_one; else make_all; fi
